"""Skill ``stir``: move a spoon's end in circles in a vessel with granules, and put the spoon back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_skill import HeldSkill, stick_frame
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.skills.skill import SkillGoal, Surroundings
from manitwin.episodes.tool_watches import StirWatch
from manitwin.geometry.cavity_floor import floor_below_rim
from manitwin.geometry.frames.feature import UP, rotation_of
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.physics.sapien.granules import create_granule_fill
from manitwin.physics.sapien.world import RobotWorld
from manitwin.scenes.layouts.pool import Pool, PoolTwin
from manitwin.scenes.layouts.stacking import open_poses

SLENDER = 4.0  # least ratio of length to width of the stirring object
LEAST_LENGTH_M, LEAST_DEPTH_M, LEAST_RIM_M = 0.12, 0.03, 0.03
# of the rim radius: radius of the circles, and their offset towards the side to which the end points, away from the rim
CIRCLE_SHARE, ASIDE_SHARE = 0.4, 0.15
FLOORS = 4  # radii at which the floor's height is measured: a bowl's floor rises towards the wall
FLOOR_M, HEAD_M = 0.006, 0.012  # lowest vertex above the floor; half width of a spoon's head
TURN_RAD, KNOTS = np.radians(1120), 44  # slightly more than three turns, spiralling inwards
INNER = 0.4  # final over initial radius
RIM_M = 0.004  # clearance between the rim and a leaning stick
ABOVE_M = 0.03  # height of the end above the rim, before and after
LEANS_RAD = np.radians([45.0, 55, 35, 25, 15])  # leans that are tried if the rim leaves room
AZIMUTHS = 8
FREE_END = 0.45  # share of the length from the end that must be free of fingers
# farthest grasp as a share of the length; distance from there to the rim, because the hand stays above it
FAR_END, HAND_M = 0.9, 0.035
STIRS_S, LONGEST_S = 6.0, 12.0


class Stir(HeldSkill):
    """Stir with the target, a slender object, in its partner, a vessel."""

    name, predicate, has_partner = "stir", "stirred", True

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a slender object at least 12 cm long, and a vessel that opens upwards and is deep and wide enough to stir in."""
        if partner is None or not partner.vessel or not open_poses(partner, pool.body(partner.twin_id)):
            return False
        opening = pool.body(partner.twin_id).opening
        if opening is None or opening.depth_m < LEAST_DEPTH_M or opening.rim_radius_m < LEAST_RIM_M:
            return False
        points = pool.body(target.twin_id).parts.whole
        extents = np.sort(np.ptp(points @ np.linalg.eigh(np.cov(points.T))[1], axis=0))
        narrow = extents[1] < (1 - CIRCLE_SHARE) * 2 * opening.rim_radius_m
        leans = leans_rad(opening.rim_radius_m, opening.depth_m, extents[0])
        inside_m = min((opening.depth_m / np.cos(lean) for lean in leans), default=np.inf)
        long_m = max(LEAST_LENGTH_M, SLENDER * extents[1], (inside_m + HAND_M) / FAR_END)
        return bool(extents[2] >= long_m and narrow)

    def sample_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal with granules in the vessel; None if it has no room for them."""
        assert partner is not None
        found, body = super().sample_goal(around, target, partner, rng), around.body(partner)
        granules = None
        if body.opening is not None:
            granules = create_granule_fill(around.objects[partner].name, body.opening, body.body.hulls, rng)
        return None if found is None or granules is None else replace(found, granules=granules)

    def task(self, scene: HeldScene) -> HeldTask:
        """Return circular paths with the working end down, leaning to several sides."""
        vessel = scene.partner
        assert vessel is not None
        target, opening = scene.target, scene.openings[vessel.name]
        up = target.object_to_world[2, :3]
        stick = stick_frame(np.concatenate(target.body.hulls), scene.frames[target.name], up)
        points = transform_points(inverse(stick), np.concatenate(target.body.hulls))
        length_m = float(-points[:, 2].min())
        center = transform_points(vessel.object_to_world, opening.center_m[None])[0]
        outs_m = np.linspace(0, CIRCLE_SHARE + ASIDE_SHARE, FLOORS) * opening.rim_radius_m
        floors_m = [center[2] + floor_below_rim(vessel.body.hulls, opening, out + HEAD_M) for out in outs_m]
        paths = []
        thick_m = float(np.ptp(points[:, :2], axis=0).min())
        for lean in leans_rad(opening.rim_radius_m, center[2] - floors_m[0], thick_m):
            for azimuth in scene.rng.uniform(-np.pi, np.pi) + np.arange(AZIMUTHS) * 2 * np.pi / AZIMUTHS:
                side = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
                down = np.sin(lean) * side - np.array([0.0, 0.0, np.cos(lean)])
                turn = rotation_of(down, UP)  # keeps the upper side, where the hand is, up
                above_m = FLOOR_M - float((points @ turn.T)[:, 2].min())
                round_m = _spiral(center, opening.rim_radius_m, side)
                out_m = np.linalg.norm(round_m[:, :2] - center[:2], axis=1)
                round_m[:, 2] = np.interp(out_m, outs_m, floors_m) + above_m
                paths.append(HeldPath(_stirring_poses(turn, center, round_m) @ inverse(stick)))

        def rank(grasp: Grasp) -> float | None:
            tips = transform_points(grasp.gripper_to_object, np.array([[0.0, 0, scene.tip_depth_m]]))
            from_end_m = float(-transform_points(inverse(stick), tips)[0, 2])
            return None if from_end_m < FREE_END * length_m else -round(from_end_m / length_m, 1)

        def watch(world: RobotWorld) -> StirWatch:
            granules = world.granules
            return StirWatch(
                target.name,
                vessel.name,
                lambda: (world.pose_of(target.name) @ stick)[:3, 3],
                lambda: world.pose_of(vessel.name),
                opening,
                (lambda: np.zeros((1, 3))) if granules is None else granules.positions_m,
                0.0 if granules is None else granules.radius_m,
            )

        return HeldTask(
            tuple(paths),
            rank,
            as_hulls=True,
            enters=frozenset({vessel.name}),
            duration_s=STIRS_S,
            longest_s=LONGEST_S,
            ending="put_back",
            comes_out=True,
            watch=watch,
        )


def leans_rad(rim_radius_m: float, depth_m: float, thick_m: float) -> list[float]:
    """Return the leans at which a stick that circles at a depth stays clear of the rim."""
    room_m = (1 - CIRCLE_SHARE + ASIDE_SHARE) * rim_radius_m - thick_m / 2 - RIM_M
    return [float(lean) for lean in LEANS_RAD if depth_m * np.tan(lean) <= room_m]


def _spiral(center_m: np.ndarray, rim_radius_m: float, side: np.ndarray) -> np.ndarray:
    """Return positions ``(K, 3)`` of the end on an inward spiral, at the rim's height."""
    start, places = float(np.arctan2(side[1], side[0])), []
    for share in np.linspace(0, 1, KNOTS):
        angle, out_m = start + share * TURN_RAD, CIRCLE_SHARE * rim_radius_m * min(1.0, 12 * share, 8 * (1 - share))
        out_m *= 1 - (1 - INNER) * share
        places.append(
            center_m + ASIDE_SHARE * rim_radius_m * side + out_m * np.array([np.cos(angle), np.sin(angle), 0.0])
        )
    return np.array(places)


def _stirring_poses(turn: np.ndarray, center_m: np.ndarray, round_m: np.ndarray) -> np.ndarray:
    """Return poses ``(K, 4, 4)`` of the end: into the vessel from above, through positions ``(K, 3)``, and out again."""
    above = np.array([*round_m[0, :2], center_m[2] + ABOVE_M])
    halfway = (above + round_m[0]) / 2
    return np.array([transform(turn, at) for at in (above, halfway, *round_m, halfway, above)])
