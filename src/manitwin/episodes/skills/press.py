"""``press``: push a button, a lid or another upward place of a thing with the closed fingertips, until it pushes back."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.events import PressWatch
from manitwin.episodes.goals.goal import SIGNATURES, Goal, Literal
from manitwin.episodes.planning.closed_hand import first_corner
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.skills.held_skill import HeldSkill
from manitwin.episodes.skills.held_task import Guard, HeldScene, HeldTask
from manitwin.geometry.hulls.error import inside_any_hull
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.world import RobotWorld
from manitwin.scenes.layouts.pool import Pool, PoolTwin
from manitwin.scenes.layouts.twin_frames import TwinFrame

KINDS = ("button", "face", "surface")  # what is pressed, where a thing has several
UPWARD = np.cos(np.radians(30))
ABOVE_M, NEAR_M, BELOW_M, FREE_KNOTS = 0.06, 0.012, 0.006, 6
LEAST_HEIGHT_M = 0.012  # above the table: the tilted hand goes a little deeper than the place
SOLID_M = 0.006  # below the place there is something to press on: the middle of a brick's top may be a hole
TILT_RAD = np.radians([10.0, 25.0])
LEAST_LEAD_M = 0.0015  # of the corner that presses: where two touch at once, the force is between them, 2 cm off
TRIED = 24
TOUCHES = FREE_KNOTS + 2  # the knot at the place's height
SPEED_M_S = 0.004
"""At most; near the place a sixth of it, 0.03 mm between two actions, in which a stiff thing presses 1 N more."""
MORE_N = 3.0  # than is asked for, so that what sags away still leaves enough


class Press(HeldSkill):
    """Close the hand and bring the lowest corner of the fingertips down on the place, slowly, until the force is there."""

    name, predicate = "press", "pressed"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a thing with a button, face or surface that looks upward as it stands, is solid, and not as low as the table."""
        standing = self.begins_in(target)[0].object_to_plane
        frame = pressed_frame(target.frames, standing)
        if frame is None or float((standing @ frame.frame_to_object)[2, 3]) < LEAST_HEIGHT_M:
            return False
        under_m = transform_points(frame.frame_to_object, np.array([[0, 0, -SOLID_M]]))
        return bool(inside_any_hull(under_m, pool.body(target.twin_id).body.hulls)[0])

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return: the target was pressed, and stays where it is."""
        return Goal((Literal(self.predicate, target.name),), (Literal("undisturbed", target.name),))

    def task(self, scene: HeldScene) -> HeldTask:
        """Return ways down to the place, the hand turned and tilted at random so that one corner of it comes first.

        None of a thing that lies so that no such place looks upward: a scene's may, and what another step has laid down.
        """
        target, rng, frames = scene.target, scene.rng, scene.frames[scene.target.name]
        frame = pressed_frame(frames, target.object_to_world)

        def watch(world: RobotWorld) -> PressWatch:
            return PressWatch(target.name, scene.fingers, lambda: pressed_place(frames, world.pose_of(target.name)))

        if frame is None:
            return HeldTask((), empty=True, watch=watch)
        place = target.object_to_world @ frame.frame_to_object
        heights_m = np.array([*np.linspace(ABOVE_M, NEAR_M, FREE_KNOTS), 0.008, 0.004, 0.0, -BELOW_M])
        paths: list[HeldPath] = []
        while len(paths) < TRIED:
            turn = rng.uniform(-np.pi, np.pi, 2)
            tilt = Rotation.from_euler("zyz", [turn[0], rng.uniform(*TILT_RAD), turn[1]]).as_matrix()
            rotation = tilt @ np.diag([1.0, -1.0, -1.0])
            corner, lead_m = first_corner(scene.fingertips_m, rotation, -place[:3, 2])
            if lead_m < LEAST_LEAD_M:
                continue
            poses = [transform(rotation, place[:3, 3] - rotation @ corner + each * place[:3, 2]) for each in heights_m]
            paths.append(HeldPath(np.array(poses), frozenset({target.name}), FREE_KNOTS))

        asked_n = SIGNATURES[self.predicate].default
        assert asked_n is not None
        guard = Guard(FREE_KNOTS, asked_n + MORE_N, speed_m_s=SPEED_M_S, touches=TOUCHES)
        return HeldTask(tuple(paths), empty=True, duration_s=1.0, measured=1, ending="keep", guard=guard, watch=watch)


def pressed_place(frames: tuple[TwinFrame, ...], object_to_world: np.ndarray) -> np.ndarray:
    """Return the frame ``(4, 4)`` in the world that is pressed of what is at a pose now; its own where none looks upward.

    Another step may have laid it down another way than it began.
    """
    frame = pressed_frame(frames, object_to_world)
    return object_to_world if frame is None else object_to_world @ frame.frame_to_object


def pressed_frame(frames: tuple[TwinFrame, ...], object_to_world: np.ndarray) -> TwinFrame | None:
    """Return the frame that is pressed: the first that looks upward at a pose ``(4, 4)``, buttons before faces and surfaces."""
    upward = [
        frame
        for frame in frames
        if frame.kind in KINDS and object_to_world[2, :3] @ frame.frame_to_object[:3, 2] >= UPWARD
    ]
    return min(upward, key=lambda frame: KINDS.index(frame.kind), default=None)
