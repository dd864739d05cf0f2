"""Skill ``hang``: hang an object on a peg by its hole, such as a mug by its handle, scissors by a ring, a wrench by its eye."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.fixtures import PEG_HEIGHT_M, PEG_LENGTH_M, PEG_RADIUS_M, Fixture, peg_stand
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_skill import HeldSkill, hole_frame_of
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.skills.skill import Surroundings
from manitwin.geometry.frames.feature import rotation_of
from manitwin.geometry.hull_holes import free_way_m, rod_passes
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, PoolTwin

LEAST_RADIUS_M = 1.8 * PEG_RADIUS_M  # the peg is square: room for its corners, and a millimetre or two
PEG_REACH_M = np.sqrt(2) * PEG_RADIUS_M + 0.0005
HALF_DEPTH_M = 0.012
"""Half depth, along a hole's axis, that is checked; geometry farther away is beside the hole, as a mug's body is beside its
handle.
"""
PEG = "peg"
FINGERS_CLEAR_M = 0.03
RADII_M, TURN_RAD, FACING_RAD = (0.45, 0.60), (0.6, 0.9), 0.6
# position of the hole before sliding on, and share of the peg's length at which it is let down
BEFORE_TIP_M, HUNG_SHARE = 0.06, 0.45
SLIDING_KNOTS, LEANS_RAD = 8, np.radians([0.0, 12, -12])
ROUNDS = 4
LET_DOWN = 1.2  # distance of the hole's upper edge above the peg's axis, in peg radii


class Hang(HeldSkill):
    """Slide the widest hole over a peg, let the object down, and release it."""

    name, predicate = "hang", "hung"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept an object whose widest hole passes the peg, also between its hulls, since some hulls fill holes."""
        frame = hole_frame_of(target.frames)
        if frame is None or frame.size_m < LEAST_RADIUS_M:
            return False
        center, axis = frame.frame_to_object[:3, 3], frame.frame_to_object[:3, 2]
        return rod_passes(pool.body(target.twin_id).body.hulls, center, axis, PEG_REACH_M, HALF_DEPTH_M)

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal that the target hangs on the peg."""
        return Goal((Literal("hung", target.name, PEG),))

    def fixture(self, around: Surroundings, target: int, rng: np.random.Generator) -> Fixture | None:
        """Draw a peg stand to one side of the target, with its peg pointing roughly at the robot."""
        x_m, y_m = around.objects[target].object_to_world[:2, 3]
        side = rng.choice([-1.0, 1.0]) * rng.uniform(*TURN_RAD)
        angle = float(np.clip(np.arctan2(y_m, x_m) + side, -1.0, 1.0))
        radius_m = rng.uniform(*RADII_M)
        height_m = around.area.support.height_m
        foot = np.array([radius_m * np.cos(angle), radius_m * np.sin(angle), height_m])
        return peg_stand(foot, angle + np.pi + rng.uniform(-FACING_RAD, FACING_RAD), height_m=PEG_HEIGHT_M, name=PEG)

    def task(self, scene: HeldScene) -> HeldTask:
        """Return the paths onto the peg, from either side of the hole, leaning to either side of the vertical."""
        frame = hole_frame_of(scene.frames[scene.target.name])
        assert frame is not None, "only things with holes are hung"
        hole = frame.frame_to_object[:3, 3]
        body, axis = scene.target.body, frame.frame_to_object[:3, 2]
        up, room_m = _hanging(body.hulls, hole, axis, body.center_of_mass_m)
        (stand,) = scene.fixtures
        paths = []
        for lean in LEANS_RAD:  # upright first: an object released as it hangs does not swing
            for sign in scene.rng.permutation([1.0, -1.0]):
                hole_to_object = transform(rotation_of(sign * axis, up), hole)
                turned = stand.frame_to_world @ transform(Rotation.from_euler("z", lean).as_matrix())
                poses = _sliding_poses(turned, room_m) @ inverse(hole_to_object)
                paths.append(HeldPath(poses, frozenset({PEG}), meant_from=SLIDING_KNOTS))

        def rank(grasp: Grasp) -> float | None:
            tips = transform_points(grasp.gripper_to_object, np.array([[0.0, 0, scene.tip_depth_m]]))[0]
            away_m = float(np.linalg.norm(tips - hole))
            return None if away_m < FINGERS_CLEAR_M else 0.0

        return HeldTask(tuple(paths), rank, as_hulls=True, duration_s=3.0)


def _hanging(
    hulls: Sequence[np.ndarray], hole_m: np.ndarray, axis: np.ndarray, center_of_mass_m: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return the up direction ``(3,)`` of an object hanging at rest, and the distance (m) from the hole's centre to its edge.

    The edge that rests on the peg is vertically above the centre of mass; found by fixed-point iteration.
    """
    up, room_m = hole_m - center_of_mass_m, 0.0
    for _ in range(ROUNDS):
        up = up - (up @ axis) * axis
        up = up / np.linalg.norm(up)
        room_m = free_way_m(hulls, hole_m, up)
        room_m = room_m if np.isfinite(room_m) else 0.0
        up = hole_m + room_m * up - center_of_mass_m
    return up, room_m


def _sliding_poses(stand: np.ndarray, room_m: float) -> np.ndarray:
    """Return poses ``(K, 4, 4)`` of the hole's frame: along the peg from before its tip, then down until the hole rests on it."""
    along_m = np.linspace(PEG_LENGTH_M + BEFORE_TIP_M, HUNG_SHARE * PEG_LENGTH_M, SLIDING_KNOTS)
    steps = [stand @ transform(translation=np.array([0.0, 0, each])) for each in along_m]
    down_m = max(room_m - LET_DOWN * PEG_RADIUS_M, 0.0)
    for share in (0.5, 1.0):
        lowered = steps[SLIDING_KNOTS - 1].copy()
        lowered[2, 3] -= share * down_m
        steps.append(lowered)
    return np.array(steps)
