"""Skill ``press``: push a button, a lid or another upward frame with the closed fingertips, until a force is reached."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.events import PressWatch
from manitwin.episodes.goals.goal import SIGNATURES, Goal, Literal
from manitwin.episodes.planning.closed_hand import first_corner
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.skills.held_skill import HeldSkill
from manitwin.episodes.skills.held_task import GuardedMove, HeldScene, HeldTask
from manitwin.geometry.hulls.error import inside_any_hull
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.world import RobotWorld
from manitwin.scenes.layouts.pool import Pool, PoolTwin
from manitwin.scenes.layouts.twin_frames import TwinFrame

KINDS = ("button", "face", "surface")  # in order of preference
UPWARD = np.cos(np.radians(30))
ABOVE_M, NEAR_M, BELOW_M, FREE_KNOTS = 0.06, 0.012, 0.006, 6
LEAST_HEIGHT_M = 0.012  # above the table, because the tilted hand goes slightly deeper than the pressed point
SOLID_M = 0.006  # depth below the point at which there must be material: the middle of a brick's top may be a hole
TILT_RAD = np.radians([10.0, 25.0])
LEAST_LEAD_M = 0.0015  # lead of the pressing vertex: if two touch at once, the force acts between them, 2 cm away
TRIED = 24
TOUCHES = FREE_KNOTS + 2  # the knot at the height of the point
SPEED_M_S = 0.004
"""Upper limit; near the point a sixth of it, 0.03 mm between two actions, in which the force on a stiff object grows by 1 N."""
MORE_N = 3.0  # above the requested force, to compensate relaxation


class Press(HeldSkill):
    """Close the hand and lower its leading fingertip vertex onto the point, slowly, until the force is reached."""

    name, predicate = "press", "pressed"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept an object with a button, face or surface that faces upwards, is solid, and is well above the table."""
        standing = self.begins_in(target)[0].object_to_plane
        frame = pressed_frame(target.frames, standing)
        if frame is None or float((standing @ frame.frame_to_object)[2, 3]) < LEAST_HEIGHT_M:
            return False
        under_m = transform_points(frame.frame_to_object, np.array([[0, 0, -SOLID_M]]))
        return bool(inside_any_hull(under_m, pool.body(target.twin_id).body.hulls)[0])

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal: the target was pressed and is undisturbed."""
        return Goal((Literal(self.predicate, target.name),), (Literal("undisturbed", target.name),))

    def task(self, scene: HeldScene) -> HeldTask:
        """Return paths down to the point, with the hand rotated and tilted randomly so that a single vertex leads.

        There are no paths if no such frame faces upwards, as in given scenes, or after another step has laid the object down.
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
        guard = GuardedMove(FREE_KNOTS, asked_n + MORE_N, speed_m_s=SPEED_M_S, touches=TOUCHES)
        return HeldTask(tuple(paths), empty=True, duration_s=1.0, measured=1, ending="keep", guard=guard, watch=watch)


def pressed_place(frames: tuple[TwinFrame, ...], object_to_world: np.ndarray) -> np.ndarray:
    """Return the pressed frame ``(4, 4)`` in the world for the object's pose; the object's own frame if none faces upwards.

    Another step may have changed the object's orientation.
    """
    frame = pressed_frame(frames, object_to_world)
    return object_to_world if frame is None else object_to_world @ frame.frame_to_object


def pressed_frame(frames: tuple[TwinFrame, ...], object_to_world: np.ndarray) -> TwinFrame | None:
    """Return the first frame that faces upwards at a pose ``(4, 4)``, buttons before faces before surfaces; or None."""
    upward = [
        frame
        for frame in frames
        if frame.kind in KINDS and object_to_world[2, :3] @ frame.frame_to_object[:3, 2] >= UPWARD
    ]
    return min(upward, key=lambda frame: KINDS.index(frame.kind), default=None)
