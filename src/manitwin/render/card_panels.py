"""The images of a twin's card: input, object, collision hulls, and grasps drawn as slim forks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import trimesh

from manitwin.geometry.boxes import box_corners
from manitwin.geometry.hulls.reduction import convex_corners, hull_mesh
from manitwin.geometry.mesh_cache import cached_on_mesh
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import farthest_point_sampling
from manitwin.render.cameras import Camera, framing_camera, project, silhouette_area_px
from manitwin.render.center_of_mass import CenterOfMass, draw_center_of_mass
from manitwin.render.markers import draw_frames, draw_markers
from manitwin.render.overlays import ground_shadow, visible_edges
from manitwin.render.raycast import cast_camera, merge_parts, visible_points
from manitwin.render.renderer import BACKDROP, shared_renderer
from manitwin.render.surfaces import plain_part
from manitwin.render.visibility import is_closed_and_outward

CLAY = (214, 210, 203)
WIRE = np.array([40, 46, 58], dtype=np.float32)
FUNCTIONAL, GRASP = (232, 112, 12), (28, 92, 210)
GRASP_COLORS = ((22, 148, 116), (43, 172, 146), (12, 122, 128), (64, 178, 116), (20, 136, 92), (84, 190, 168))
# Twelve soft hues with distinct neighbours: the categorical set "Set3" of ColorBrewer (Brewer 2003).
HULL_COLORS = (
    (141, 211, 199), (251, 128, 114), (128, 177, 211), (253, 180, 98), (190, 186, 218), (179, 222, 105),
    (252, 205, 229), (255, 237, 111), (188, 128, 189), (204, 235, 197), (217, 217, 217), (255, 255, 179),
)  # fmt: skip
DRAWN_GRASPS = 12
INPUT_MARGIN = 0.12  # fraction of the longer side of a photo's cut-out: about the margin of the rendered object
FRAME_SHARE = 0.16  # fraction of the longest side: length of a drawn frame's Z axis

Boxes = Sequence[tuple[np.ndarray, np.ndarray]]
"""``(box_to_gripper (4, 4), half_extents_m (3,))`` of each box of palm and fingers; grasp frame: +Z approach, X closing."""

_unit_box = trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
_UNIT_BOX = np.asarray(_unit_box.vertices), np.asarray(_unit_box.faces)  # created once, as trimesh takes a millisecond

STEM_SHARE = 0.5  # length of the stem relative to the fingers


@dataclass(frozen=True)
class CardPoint:
    """A functional or grasp point: position and outward normal in the object frame, and label.

    ``frame_to_object (4, 4)`` is the functional frame, of which Z and X are drawn; None if there is none.
    """

    position_m: np.ndarray
    normal: np.ndarray
    label: str
    functional: bool
    frame_to_object: np.ndarray | None = None


@dataclass(frozen=True)
class CardGrasp:
    """A verified grasp: ``gripper_to_object (4, 4)``, and the gripper's boxes at its opening width in the grasp frame."""

    gripper_to_object: np.ndarray
    boxes: Boxes


def render_panel(parts: Sequence[trimesh.Trimesh], mesh: trimesh.Trimesh, hero: Camera) -> np.ndarray:
    """Draw the textured object on the ground."""
    return _render_on_ground(list(parts), mesh, hero)


def clay_panel(mesh: trimesh.Trimesh, hero: Camera) -> np.ndarray:
    """Draw the untextured shape, seen from the opposite side."""
    return _render_on_ground([plain_part(mesh, CLAY)], mesh, _turned(hero, np.asarray(mesh.vertices), 180.0))


def mesh_panel(
    solid: trimesh.Trimesh, hulls: Sequence[np.ndarray], hero: Camera, mass: CenterOfMass | None = None
) -> np.ndarray:
    """Draw the convex hulls in different colours, overlaid with the solid mesh's visible edges and the centre of mass."""
    camera = _turned(hero, np.concatenate([np.asarray(solid.vertices), *hulls]), 0.0)
    parts = _merge_by_color([hull_mesh(hull) for hull in hulls], HULL_COLORS, roughness=0.9)
    picture = shared_renderer().render(parts, [camera], with_backs=False)[0].rgb.astype(np.float32)
    depth, _, _ = cast_camera(RayCaster(solid), camera)
    cover = visible_edges(solid, camera, depth)
    # The edges darken the image by at most a quarter, as a fine mesh would otherwise be black.
    strength = min(2.2, 0.25 * max(1, int((depth > 0).sum())) / max(1e-6, float(cover.sum())))
    alpha = np.minimum(cover * strength, 0.85)[..., None]
    drawn = np.rint(picture * (1 - alpha) + WIRE * alpha).astype(np.uint8)
    return drawn if mass is None else draw_center_of_mass(drawn, mass, camera)


def grasp_panel(
    parts: Sequence[trimesh.Trimesh],
    mesh: trimesh.Trimesh,
    points: Sequence[CardPoint],
    grasps: Sequence[CardGrasp],
    hero: Camera,
) -> np.ndarray:
    """Draw the object with its points and up to twelve diverse verified grasps."""
    drawn = [
        grasps[i]
        for i in select_diverse_grasps(np.array([g.gripper_to_object for g in grasps]).reshape(-1, 4, 4), DRAWN_GRASPS)
    ]
    rod_m = 0.012 * float(np.linalg.norm(mesh.extents)) + 0.001
    forks = [gripper_fork(grasp.boxes, rod_m).apply_transform(grasp.gripper_to_object) for grasp in drawn]
    everything = np.concatenate([mesh.vertices, *(fork.vertices for fork in forks)])
    camera, seen = _most_informative_camera(mesh, everything, points, hero)
    picture = _render_on_ground([*parts, *_merge_by_color(forks, GRASP_COLORS, roughness=0.5)], mesh, camera)
    shown = [point for point, visible in zip(points, seen, strict=True) if visible]
    pixels, _ = project(np.array([point.position_m for point in shown]).reshape(-1, 3), camera)
    colors = [FUNCTIONAL if point.functional else GRASP for point in shown]
    frames = [point.frame_to_object for point in points if point.frame_to_object is not None]
    picture = draw_frames(picture, frames, camera, FRAME_SHARE * float(mesh.extents.max()))
    return draw_markers(
        picture, pixels, [point.label for point in shown], colors=colors, font_px=max(10, hero.height_px // 27)
    )


def input_panel(picture: np.ndarray, size_px: int) -> np.ndarray:
    """Fit a photo ``(H, W, 3 or 4) uint8`` into the panel over the backdrop: the whole photo, or its cut-out with a margin."""
    if picture.shape[2] == 4 and (picture[..., 3] > 127).any():
        picture = picture[_padded_bounds(picture[..., 3] > 127)]
    scale = size_px / max(picture.shape[:2])
    width, height = (max(1, round(side * scale)) for side in picture.shape[1::-1])
    fitted = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC)
    alpha = (
        fitted[..., 3:].astype(np.float32) / 255 if fitted.shape[2] == 4 else np.ones((height, width, 1), np.float32)
    )
    panel = np.full((size_px, size_px, 3), BACKDROP, dtype=np.uint8)
    top, left = (size_px - height) // 2, (size_px - width) // 2
    over = fitted[..., :3] * alpha + np.array(BACKDROP, dtype=np.float32) * (1 - alpha)
    panel[top : top + height, left : left + width] = np.rint(over).astype(np.uint8)
    return panel


def _padded_bounds(seen: np.ndarray) -> tuple[slice, slice]:
    """Return the rows and columns of a mask ``(H, W) bool``, with a margin within the image."""
    spans = [np.flatnonzero(seen.any(axis=axis)) for axis in (1, 0)]
    margin = round(INPUT_MARGIN * max(int(span[-1] - span[0] + 1) for span in spans))
    rows, columns = (slice(max(0, int(span[0]) - margin), int(span[-1]) + 1 + margin) for span in spans)
    return rows, columns


def select_diverse_grasps(gripper_to_object: np.ndarray, count: int) -> np.ndarray:
    """Return the indices of up to ``count`` grasps ``(N, 4, 4)``, diverse in position and approach direction."""
    if not len(gripper_to_object):
        return np.zeros(0, dtype=int)
    tips = gripper_to_object[:, :3, 3] + 0.1 * gripper_to_object[:, :3, 2]
    spread = max(float(np.linalg.norm(tips.max(0) - tips.min(0))), 1e-3)
    return farthest_point_sampling(np.hstack([tips, 0.35 * spread * gripper_to_object[:, :3, 2]]), count)


def _merge_by_color(
    shapes: Sequence[trimesh.Trimesh], colors: Sequence[tuple[int, int, int]], *, roughness: float
) -> list[trimesh.Trimesh]:
    """Return one part per colour; the shapes are assigned to the colours in turn."""
    turns = [list(shapes[index :: len(colors)]) for index in range(min(len(colors), len(shapes)))]
    return [
        plain_part(merge_parts(turn), color, roughness=roughness) for turn, color in zip(turns, colors, strict=False)
    ]


def _turned(hero: Camera, points: np.ndarray, turn_deg: float) -> Camera:
    """Return the camera that frames ``points`` from the hero camera's elevation, rotated about the vertical."""
    x, y, z = hero.camera_to_object[:3, 2]
    return framing_camera(
        points,
        azimuth_deg=float(np.rad2deg(np.arctan2(y, x))) + turn_deg,
        elevation_deg=float(np.rad2deg(np.arcsin(z))),
        fov_y_deg=float(np.rad2deg(hero.fov_y_rad)),
        width_px=hero.width_px,
        height_px=hero.height_px,
    )


def _most_informative_camera(
    mesh: trimesh.Trimesh, everything: np.ndarray, points: Sequence[CardPoint], hero: Camera
) -> tuple[Camera, np.ndarray]:
    """Return the camera, among twelve around the object, that shows the most points at a large scale, and which points it
    sees.
    """
    caster = RayCaster(mesh)
    positions = np.array([point.position_m for point in points]).reshape(-1, 3)
    normals = np.array([point.normal for point in points]).reshape(-1, 3)
    tolerance_m = 0.01 * float(mesh.extents.max())
    outline, everything = (convex_corners(np.asarray(cloud))[0] for cloud in (mesh.vertices, everything))
    best: tuple[float, Camera, np.ndarray] | None = None
    for turn in (0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6):
        camera = _turned(hero, everything, 30.0 * turn)
        seen = visible_points(positions, normals, camera, caster, tolerance_m)
        # One more visible point weighs as much as a third of the panel's area.
        share = silhouette_area_px(outline, camera) / (hero.width_px * hero.height_px)
        score = float(seen.sum()) + 3 * share
        if best is None or score > best[0] + 1e-6:
            best = score, camera, seen
    assert best is not None
    return best[1], best[2]


def _render_on_ground(parts: list[trimesh.Trimesh], mesh: trimesh.Trimesh, camera: Camera) -> np.ndarray:
    """Draw ``parts`` (those of ``mesh``, and further closed ones) over the shadow of ``mesh`` on the ground."""
    closed = cached_on_mesh(mesh, "closed and outward", lambda: is_closed_and_outward(mesh))
    frame = shared_renderer().render(parts, [camera], with_backs=not closed)[0]
    shade = ground_shadow(mesh, camera)
    behind, picture = ((1 - frame.coverage) * (1 - shade)).astype(float), np.empty_like(frame.rgb)
    for channel, ground in enumerate(BACKDROP):
        picture[..., channel] = np.rint(np.clip(frame.rgb[..., channel] - behind * ground, 0, 255))
    return picture


def gripper_fork(boxes: Boxes, rod_m: float) -> trimesh.Trimesh:
    """Return rods of thickness ``rod_m`` in the grasp frame: one along each finger's inner face, a crossbar and a stem.

    Fingers are the boxes on either side of the plane x = 0; they reach from the palm's front to their tips. A gripper without
    fingers, such as a suction cup, is drawn as its boxes.
    """
    sides: dict[int, list[np.ndarray]] = {1: [], -1: []}
    front = 0.0
    for box_to_gripper, half in boxes:
        corners = box_corners(half, box_to_gripper)
        if abs(box_to_gripper[0, 3]) < 1e-9:
            front = max(front, float(corners[:, 2].max()))
        else:
            sides[1 if box_to_gripper[0, 3] > 0 else -1].append(corners)
    if not all(sides.values()):
        return gripper_body(boxes)
    rods, tips = [], []
    for corners_of_side in sides.values():
        corners = np.concatenate(corners_of_side)
        x = float(corners[np.abs(corners[:, 0]).argmin(), 0])
        x += np.copysign(rod_m / 2, float(corners[:, 0].mean()))
        tips.append(float(corners[:, 2].max()))
        rods.append(_rod([x, 0, front], [x, 0, tips[-1]], rod_m))
    reach = max(abs(float(rod.vertices[:, 0].mean())) for rod in rods)
    rods.append(_rod([-reach, 0, front], [reach, 0, front], rod_m))
    rods.append(_rod([0, 0, front - STEM_SHARE * (max(tips) - front)], [0, 0, front], rod_m))
    return merge_parts(rods)


def gripper_body(boxes: Boxes) -> trimesh.Trimesh:
    """Return the gripper's boxes as one mesh in the grasp frame."""
    return merge_parts([trimesh.creation.box(2 * half, box_to_gripper) for box_to_gripper, half in boxes])


def _rod(start: Sequence[float], end: Sequence[float], thickness: float) -> trimesh.Trimesh:
    """Return a square rod along an axis of the frame, with closed ends."""
    low, high = np.minimum(start, end) - thickness / 2, np.maximum(start, end) + thickness / 2
    return trimesh.Trimesh(low + _UNIT_BOX[0] * (high - low), _UNIT_BOX[1], process=False)
