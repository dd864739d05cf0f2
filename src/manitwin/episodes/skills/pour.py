"""Skill ``pour``: empty a vessel of its granules into another one over its lip, turn it upright again, and put it back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_skill import HeldSkill, frames_of
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.skills.skill import SkillGoal, Surroundings
from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject, RigidBody
from manitwin.physics.sapien.granules import FILL_SHARE, create_granule_fill
from manitwin.scenes.layouts.pool import Pool, PoolTwin
from manitwin.scenes.layouts.stacking import open_poses
from manitwin.scenes.layouts.twin_frames import TwinFrame

SHORT_OF_MIDDLE = 0.45  # distance of the lip from the centre of the receiving vessel, in rim radii
CLEAR_M = 0.015  # clearance of the lowest vertex above that vessel's rim
# the same for a hand that holds the rim and comes below it: vessels too heavy for their handle are held there
HIGH_M = 0.10
# the path starts higher, because the rotation in the hand is measured on the way
ABOVE_M, LOW_FROM_RAD = 0.05, np.radians(50)
TILT_RAD, TILTS = np.radians(115), 13
# a vessel that is a sixth full starts to spill at about 60 degrees, or less when it is swung
LEVEL_RAD = np.radians(40)
DEEP, DEEP_TILT_RAD, DEEP_LASTS_S = 3.0, np.radians(135), 2.0
"""Ratio of depth to rim radius from which a vessel is deep; a belly below a neck empties later and takes longer."""
AZIMUTHS = 8
POURS_S, LASTS_S, LONGEST_S = 2.5, 0.5, 4.0
MOST_SHARE = 0.8  # of the receiving vessel's volume
LEAST_DEPTH_M = 0.025  # of the receiving vessel: granules roll off a plate
# of the receiving vessel, and ratio of the source's rim radius to its: a stream spreads as it falls
LEAST_RIM_M, RIM_SHARE = 0.03, 2 / 3
LIP_BAND_M, LIP_RAD = 0.008, np.radians(20)
FINGER_M = 0.006  # half thickness of a finger
INSIDE_M = 0.002  # a fingertip deeper than this below the rim is inside
BESIDE_LIP_RAD, AWAY_STEP_RAD = np.radians(60), np.radians(30)


class Pour(HeldSkill):
    """Pour from the target, a vessel with a lip, into its partner, a vessel that holds the whole content."""

    name, predicate, has_partner = "pour", "poured", True

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept vessels that open upwards; the partner's rim is at least 3 cm and wider than the target's.

        The partner must also be deeper than a plate and hold the target's granules.
        """
        if partner is None or not (target.vessel and partner.vessel) or lip_frame(target) is None:
            return False
        first, second = (pool.body(twin.twin_id) for twin in (target, partner))
        source, vessel = first.opening, second.opening
        if source is None or vessel is None or not (open_poses(target, first) and open_poses(partner, second)):
            return False
        holds = FILL_SHARE * source.volume_m3 <= MOST_SHARE * vessel.volume_m3
        deep = vessel.depth_m >= LEAST_DEPTH_M
        return holds and deep and vessel.rim_radius_m >= max(LEAST_RIM_M, source.rim_radius_m / RIM_SHARE)

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal: poured, with the target upright again and the partner undisturbed."""
        assert partner is not None
        stays = (Literal("upright", target.name), Literal("undisturbed", partner.name))
        return Goal((Literal(self.predicate, target.name, partner.name),), stays)

    def sample_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal with granules in the target; None if it has no room for them."""
        name, body = around.objects[target].name, around.body(target)
        found = super().sample_goal(around, target, partner, rng)
        granules = None if body.opening is None else create_granule_fill(name, body.opening, body.body.hulls, rng)
        return None if found is None or granules is None else replace(found, granules=granules)

    def task(self, scene: HeldScene) -> HeldTask:
        """Return the tilts over the partner's rim, from eight sides."""
        assert scene.partner is not None
        lip, vessel = lip_of(scene), scene.openings[scene.partner.name]
        center = transform_points(scene.partner.object_to_world, vessel.center_m[None])[0]
        source = scene.openings[scene.target.name]
        deep = source.depth_m > DEEP * source.rim_radius_m
        tilt_rad = DEEP_TILT_RAD if deep else TILT_RAD
        first_rad = scene.rng.uniform(-np.pi, np.pi)
        low, high = (
            pouring_paths(lip, scene.target.body, center, vessel.rim_radius_m, tilt_rad, first_rad, clear_m)
            for clear_m in (CLEAR_M, HIGH_M)
        )
        return HeldTask(
            paths=low,
            otherwise=high,
            steady=True,
            rank=lambda grasp: grasp_rank(grasp, source, lip, scene.tip_depth_m),
            as_hulls=True,
            duration_s=POURS_S,
            longest_s=LONGEST_S,
            hold_s=DEEP_LASTS_S if deep else LASTS_S,
            ending="put_back",
            level_rad=LEVEL_RAD,
        )


def lip_frame(twin: PoolTwin) -> TwinFrame | None:
    """Return the frame of an opening with a pouring side: opposite a handle, or at a spout."""
    return next((frame for frame in frames_of(twin, "opening") if not frame.roll_free), None)


def lip_of(scene: HeldScene) -> np.ndarray:
    """Return the lip's frame ``(4, 4)`` in the target's: at the rim, X in the pouring direction, Z out of the opening."""
    frame = next(f for f in scene.frames[scene.target.name] if f.kind == "opening" and not f.roll_free)
    points = transform_points(inverse(frame.frame_to_object), np.concatenate(scene.target.body.hulls))
    out_m, azimuth = np.linalg.norm(points[:, :2], axis=1), np.arctan2(points[:, 1], points[:, 0])
    at_lip = (np.abs(points[:, 2]) < LIP_BAND_M) & (np.abs(azimuth) < LIP_RAD)
    reach_m = max(frame.size_m, float(out_m[at_lip].max(initial=0.0)))
    return np.asarray(frame.frame_to_object @ transform(None, np.array([reach_m, 0.0, 0.0])))


def pouring_paths(
    lip: np.ndarray,
    body: RigidBody,
    center_m: np.ndarray,
    rim_radius_m: float,
    tilt_rad: float,
    first_rad: float,
    clear_m: float,
) -> tuple[HeldPath, ...]:
    """Return tilts about the lip's Y axis from eight sides, with the lip short of the centre.

    The lowest vertex stays ``clear_m`` above the rim. Each path starts slightly higher and comes down while it tilts to
    ``tilt_rad``.
    """
    corners = transform_points(inverse(lip), np.concatenate(body.hulls))
    paths = []
    for azimuth in first_rad + np.arange(AZIMUTHS) * 2 * np.pi / AZIMUTHS:
        poses = []
        for tilt in np.linspace(0, tilt_rad, TILTS):
            above_m = clear_m + (ABOVE_M - CLEAR_M) * max(0.0, 1 - tilt / LOW_FROM_RAD) ** 2
            turn = Rotation.from_euler("ZY", [azimuth, tilt]).as_matrix()
            way = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
            at = center_m - SHORT_OF_MIDDLE * rim_radius_m * way
            at[2] += above_m - (corners @ turn.T)[:, 2].min()
            poses.append(transform(turn, at) @ inverse(lip))
        paths.append(HeldPath(np.array(poses)))
    return tuple(paths)


def grasp_rank(grasp: Grasp, opening: Opening, lip: np.ndarray, tip_depth_m: float) -> float | None:
    """Rank grasps, smallest first: by the angle from the lip in steps, and those with a finger inside the vessel last.

    None for a finger inside near the lip. The steps make all places on a handle far from the lip equal.
    """
    side = grasp.width_m / 2 + FINGER_M
    tips = transform_points(grasp.gripper_to_object, np.array([[s, 0.0, tip_depth_m] for s in (-side, 0.0, side)]))
    from_rim = tips - opening.center_m
    height = from_rim @ opening.axis
    across = from_rim - height[:, None] * opening.axis
    inside = (height < -INSIDE_M) & (np.linalg.norm(across, axis=1) < opening.rim_radius_m)
    towards = float(np.arctan2(across[1] @ lip[:3, 1], across[1] @ lip[:3, 0]))
    if inside[[0, 2]].any() and abs(towards) < BESIDE_LIP_RAD:
        return None
    away = float(np.floor((np.pi - abs(towards)) / AWAY_STEP_RAD))
    return away + (2 * np.pi / AWAY_STEP_RAD if inside[[0, 2]].any() else 0.0)
