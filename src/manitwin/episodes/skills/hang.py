"""``hang``: put a thing on a peg by its hole: a mug by its handle, scissors by a ring, a wrench by its eye."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.fixtures import PEG_HEIGHT_M, PEG_LENGTH_M, PEG_RADIUS_M, Fixture, peg_stand
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.planning.held_path import HeldPath
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_skill import HeldSkill, frames_of, hole_frame_of
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.skills.skill import Surroundings
from manitwin.geometry.frames.feature import rotation_of
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, PoolTwin

LEAST_RADIUS_M = 1.8 * PEG_RADIUS_M  # the peg is square: its corners, and a millimetre or two of room
PEG = "peg"
FINGERS_CLEAR_M = 0.03
RADII_M, TURN_RAD, FACING_RAD = (0.45, 0.60), (0.6, 0.9), 0.6
BEFORE_TIP_M, HUNG_SHARE = 0.06, 0.45  # where the hole is before it goes on, and how far along the peg it is let down
SLIDING_KNOTS, LEANS_RAD = 8, np.radians([0.0, 15, -15, 30, -30])
LET_DOWN = 1.2  # peg radii that the hole's upper edge stays above the peg's middle


class Hang(HeldSkill):
    """Slide the widest hole over a peg, let it down, and let go."""

    name, predicate = "hang", "hung"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a thing with a hole that the peg passes."""
        return any(frame.size_m >= LEAST_RADIUS_M for frame in frames_of(target, "hole"))

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return: hung on the peg."""
        return Goal((Literal("hung", target.name, PEG),))

    def fixture(self, around: Surroundings, target: int, rng: np.random.Generator) -> Fixture | None:
        """Draw a peg stand to one side of the target, its peg pointing at the robot, more or less."""
        x_m, y_m = around.objects[target].object_to_world[:2, 3]
        side = rng.choice([-1.0, 1.0]) * rng.uniform(*TURN_RAD)
        angle = float(np.clip(np.arctan2(y_m, x_m) + side, -1.0, 1.0))
        radius_m = rng.uniform(*RADII_M)
        height_m = around.area.support.height_m
        foot = np.array([radius_m * np.cos(angle), radius_m * np.sin(angle), height_m])
        return peg_stand(foot, angle + np.pi + rng.uniform(-FACING_RAD, FACING_RAD), height_m=PEG_HEIGHT_M, name=PEG)

    def task(self, scene: HeldScene) -> HeldTask:
        """Return the ways on to the peg, from either side of the hole, leaning to either side of the upright."""
        frame = hole_frame_of(scene.frames[scene.target.name])
        assert frame is not None, "only things with holes are hung"
        hole = frame.frame_to_object[:3, 3]
        up = hole - scene.target.body.center_of_mass_m  # what hangs has its centre of mass below the hole
        (stand,) = scene.fixtures
        paths = []
        for lean in LEANS_RAD:  # the upright first: what is let go as it hangs does not swing
            for sign in scene.rng.permutation([1.0, -1.0]):
                hole_to_object = transform(rotation_of(sign * frame.frame_to_object[:3, 2], up), hole)
                turned = stand.frame_to_world @ transform(Rotation.from_euler("z", lean).as_matrix())
                poses = _onto(turned, frame.size_m) @ inverse(hole_to_object)
                paths.append(HeldPath(poses, frozenset({PEG}), meant_from=SLIDING_KNOTS))

        def rank(grasp: Grasp) -> float | None:
            tips = transform_points(grasp.gripper_to_object, np.array([[0.0, 0, scene.tip_depth_m]]))[0]
            away_m = float(np.linalg.norm(tips - hole))
            return None if away_m < FINGERS_CLEAR_M else 0.0

        return HeldTask(tuple(paths), rank, as_hulls=True, duration_s=3.0)


def _onto(stand: np.ndarray, radius_m: float) -> np.ndarray:
    """Return poses ``(K, 4, 4)`` of the hole's frame: along the peg from before its tip, then down until the hole rests on it."""
    along_m = np.linspace(PEG_LENGTH_M + BEFORE_TIP_M, HUNG_SHARE * PEG_LENGTH_M, SLIDING_KNOTS)
    steps = [stand @ transform(translation=np.array([0.0, 0, each])) for each in along_m]
    down_m = max(radius_m - LET_DOWN * PEG_RADIUS_M, 0.0)
    for share in (0.5, 1.0):
        lowered = steps[SLIDING_KNOTS - 1].copy()
        lowered[2, 3] -= share * down_m
        steps.append(lowered)
    return np.array(steps)
