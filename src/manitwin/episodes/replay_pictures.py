"""Rendering of recorded states: the robot by the visual shapes of its URDF, the objects, fixtures, granules and furniture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from types import TracebackType

import numpy as np
import trimesh

from manitwin.episodes.cameras import NamedCamera
from manitwin.episodes.recording import Recording
from manitwin.episodes.robot_appearance import link_drawables
from manitwin.errors import UsageError
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.geometry.rigid_body import StaticBox
from manitwin.render.drawable import Drawable, prepare_drawable
from manitwin.render.procedural_textures import procedural_texture, textured_box
from manitwin.render.scene_lighting import STUDIO, Lighting
from manitwin.render.scene_renderer import SceneFrame, SceneRenderer, ShadowRegion
from manitwin.robots.links import poses_at, read_urdf_links
from manitwin.robots.robot import Robot
from manitwin.robots.urdf import UrdfTree
from manitwin.scenes.furniture_pictures import TEXTURE_VARIANTS, add_furniture
from manitwin.scenes.scene import Furniture, SurfaceBox
from manitwin.scenes.twin_surfaces import simplified_twin_drawable

FINE_PX = 640
FINEST_M = 0.0008
"""Smallest tolerance of surface simplification."""
LINKS_M, MOST_OF_LINKS_M = 0.0024, 0.012
"""Tolerance for a robot's links in pictures of ``FINE_PX``, and its maximum for smaller pictures, in proportion. It bounds
the sum of a vertex's errors: 99 % of the surface of a Panda or a UR5 stays within 0.4 of it, a pixel's width at 1 m or less.
"""
OBJECTS_M, MOST_OF_OBJECTS_M, MOST_OF_FINGERS_M = 0.0008, 0.0024, 0.0016
"""For objects and fingers, which may be thin and are seen from nearby by a camera on the hand, fingers from nearest."""
FIXTURE_MATERIAL = "metal"
GRANULE_RGBA = (205, 150, 60, 255)  # roughly the colour of grain
TABLE = Furniture(
    kind="table",
    support_height_m=0.0,
    boxes=(SurfaceBox(name="table", center_m=(0.4, 0.0, -0.02), half_extents_m=(0.65, 0.7, 0.02), material="wood"),),
)
"""Furniture of an episode without a scene."""


def link_poses(robot: Robot, joint_positions_rad: np.ndarray, hand: np.ndarray) -> dict[str, np.ndarray]:
    """Return every link's ``link_to_world (4, 4)``, by name.

    ``joint_positions_rad`` are the arm's, in the order of ``robot.arm_joints``; ``hand (h,)`` is as in recordings: each jaw
    is at half of the opening.
    """
    joints = dict(zip(robot.arm_joints, np.asarray(joint_positions_rad, float), strict=False))
    joints.update(zip(robot.finger_joints, robot.hand_joints(np.asarray(hand, float)).tolist(), strict=True))
    return poses_at(read_urdf_links(robot.urdf), joints)


def link_tolerance_m(picture_px: int) -> float:
    """Return the simplification tolerance of a robot's links for pictures of at most ``picture_px`` a side."""
    return min(max(LINKS_M * FINE_PX / picture_px, FINEST_M), MOST_OF_LINKS_M)


def object_tolerance_m(picture_px: int, most_m: float = MOST_OF_OBJECTS_M) -> float:
    """Return the simplification tolerance of objects or fingers for pictures of at most ``picture_px`` a side."""
    return min(max(OBJECTS_M * FINE_PX / picture_px, FINEST_M), most_m)


def twin_drawable(folder: Path, picture_px: int = FINE_PX) -> Drawable:
    """Return a twin's appearance, simplified for pictures of at most ``picture_px``; cached. Raises TwinError."""
    return simplified_twin_drawable(folder, object_tolerance_m(picture_px))


class EpisodeReplay:
    """A robot, objects and furniture, uploaded once, for rendering recordings. Close it, or use a ``with`` statement.

    ``objects`` are those of the recording, in its order: prepared (``twin_drawable``), or as visual meshes in their own
    frames. ``granules`` are their number and radius, m.
    """

    def __init__(
        self,
        robot: Robot,
        objects: Sequence[Drawable | Sequence[trimesh.Trimesh]],
        *,
        furniture: Furniture = TABLE,
        fixtures: Sequence[StaticBox] = (),
        granules: tuple[int, float] | None = None,
        lighting: Lighting = STUDIO,
        seed: int = 0,
        picture_px: int = FINE_PX,
    ) -> None:
        """Upload everything for pictures of at most ``picture_px`` a side; smaller pictures use simpler links.

        ``seed`` selects the furniture's textures. Raises RendererMissing, AssetError, UsageError.
        """
        self._robot = robot
        self._renderer = SceneRenderer(lighting, shadows=ShadowRegion().for_pictures_of(picture_px))
        self._objects = [f"object_{index:02d}" for index in range(len(objects))]
        for name, thing in zip(self._objects, objects, strict=True):
            ready = thing if isinstance(thing, Drawable) else prepare_drawable(thing, tolerance_m=FINEST_M)
            self._renderer.add(name, ready)
        fingers = _moved_by(robot.urdf, robot.finger_joints)
        of_fingers_m = object_tolerance_m(picture_px, MOST_OF_FINGERS_M)
        links = link_drawables(robot.urdf, link_tolerance_m(picture_px), of_fingers_m, fingers)
        self._links = list(links)
        for link, visual in links.items():
            self._renderer.add(f"{robot.name}/{link}", visual)
        add_furniture(self._renderer, furniture, seed=seed)
        for number, box in enumerate(fixtures):
            texture = procedural_texture(FIXTURE_MATERIAL, number % TEXTURE_VARIANTS)
            looks = [textured_box(np.asarray(box.half_extents_m, float), texture)]
            self._renderer.add(box.name, looks, box.box_to_world)
        self._granules: list[str] = []
        if granules is not None:
            sphere = _sphere(granules[1])
            self._granules = [f"granule_{number:03d}" for number in range(granules[0])]
            for name in self._granules:
                self._renderer.add(name, sphere)

    def __enter__(self) -> EpisodeReplay:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Release the driver's resources."""
        self._renderer.close()

    @property
    def ids(self) -> dict[str, int]:
        """Ids in the segmentation pictures: objects, then ``robot/link``, then furniture, fixture boxes, granules."""
        return self._renderer.ids

    def frames(
        self,
        recording: Recording,
        cameras: Sequence[NamedCamera],
        *,
        width_px: int,
        height_px: int,
        every: int = 1,
        geometry: bool = False,
    ) -> Iterator[list[SceneFrame]]:
        """Yield the pictures of all cameras at states 0, ``every``, 2 ``every`` and so on, of the T + 1 states.

        With ``geometry``, depth, normals and ids are included. Raises UsageError if the recording has another number of
        objects.
        """
        count = recording.object_positions_m.shape[1]
        if count != len(self._objects):
            raise UsageError(
                f"the recording has {count} objects, the replay {len(self._objects)}; give those of the episode"
            )
        for state in range(0, recording.steps + 1, every):
            hand = self._show(recording, state)
            placed = [camera.placed(hand, width_px, height_px) for camera in cameras]
            yield self._renderer.render(placed, geometry=geometry)

    def picture(
        self,
        object_to_world: Sequence[np.ndarray],
        joint_positions_rad: np.ndarray,
        hand: np.ndarray,
        cameras: Sequence[NamedCamera],
        *,
        size_px: int,
    ) -> list[np.ndarray]:
        """Return pictures ``(size, size, 3) uint8`` of a state outside a recording; poses ``(4, 4)`` in the objects' order.

        ``hand (h,)`` is as in recordings.
        """
        gripper_to_world = self._place(object_to_world, joint_positions_rad, hand)
        placed = [camera.placed(gripper_to_world, size_px, size_px) for camera in cameras]
        return [frame.rgb for frame in self._renderer.render(placed)]

    def _show(self, recording: Recording, state: int) -> np.ndarray:
        """Set all poses to those of a state; return the hand's ``gripper_to_world (4, 4)``."""
        rotations = rotation_from_quaternion_wxyz(recording.object_quaternions_wxyz[state])
        positions = recording.object_positions_m[state]
        objects = [transform(rotation, position) for rotation, position in zip(rotations, positions, strict=True)]
        if recording.granule_positions_m is not None:
            for name, position in zip(self._granules, recording.granule_positions_m[state], strict=True):
                self._renderer.set_pose(name, transform(None, position))
        return self._place(objects, recording.joint_positions_rad[state], recording.hand[state])

    def _place(
        self, object_to_world: Sequence[np.ndarray], joint_positions_rad: np.ndarray, hand: np.ndarray
    ) -> np.ndarray:
        for name, pose in zip(self._objects, object_to_world, strict=True):
            self._renderer.set_pose(name, pose)
        poses = link_poses(self._robot, joint_positions_rad, hand)
        for link in self._links:
            self._renderer.set_pose(f"{self._robot.name}/{link}", poses[link])
        return poses[self._robot.tip_link] @ self._robot.gripper_to_tip


@lru_cache(maxsize=4)
def _moved_by(urdf: str, joints: tuple[str, ...]) -> frozenset[str]:
    """Return the child links of these joints of a URDF."""
    tree = UrdfTree.of_text(urdf)
    return frozenset(
        joint.find("child").get("link") for joint in tree.element.findall("joint") if joint.get("name") in joints
    )


@lru_cache(maxsize=4)
def _sphere(radius_m: float) -> Drawable:
    sphere = trimesh.creation.icosphere(subdivisions=2, radius=radius_m)
    material = trimesh.visual.material.PBRMaterial(
        baseColorFactor=GRANULE_RGBA, roughnessFactor=0.8, metallicFactor=0.0
    )
    sphere.visual = trimesh.visual.TextureVisuals(material=material)
    return prepare_drawable([sphere])
