"""Skill ``aim``: point the target's nozzle, lens or scanner window at another object, and put the target back."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.goals.tool_use import AIMED_S
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_skill import HeldSkill
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.tool_watches import AimWatch
from manitwin.geometry.frames.feature import rotation_of
from manitwin.geometry.frames.label_keywords import grip_rank, is_aiming_label
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.physics.sapien.world import RobotWorld
from manitwin.scenes.layouts.pool import Pool, PoolTwin
from manitwin.scenes.layouts.twin_frames import TwinFrame

KINDS = ("tip", "opening", "hole", "face", "surface", "button")
DISTANCES_M = (0.10, 0.22)  # of the nozzle from the centre of the object it points at
FARTHER_M, KNOTS = 0.05, 3  # distance over which the nozzle approaches
DOWNWARD_RAD = np.radians([0.0, 60.0])
DRAWN, WAYS = 600, 48
UPRIGHT_SHARE = 0.5  # share of the paths without rotation about the nozzle's axis, tried first with all grasps
LEAST_HEIGHT_M = 0.02  # of the lowest vertex above its initial support
FREE_M = 0.02  # clearance of the finger pads from the nozzle's axis, ahead of its end
NEAR_STEP_M = 0.02  # grasps whose distances to the grip differ by less count as equal
HELD_S = 2 * AIMED_S


class Aim(HeldSkill):
    """Point the target's nozzle at its partner from some distance, hold still, and put the target back."""

    name, predicate, has_partner = "aim", "aimed", True

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a target with a nozzle, a lens or another pointing frame, and any partner."""
        return partner is not None and nozzle_of(target.frames) is not None

    def task(self, scene: HeldScene) -> HeldTask:
        """Return paths that point at the partner, from random azimuths, downward angles and rolls about the nozzle's axis."""
        target, aimed_at, rng = scene.target, scene.partner, scene.rng
        nozzle = nozzle_of(scene.frames[target.name])
        assert aimed_at is not None
        assert nozzle is not None, "only things that point are aimed"
        center = transform_points(aimed_at.object_to_world, aimed_at.body.center_of_mass_m[None])[0]
        upright = rotation_of(
            nozzle.frame_to_object[:3, 2], target.object_to_world[2, :3]
        )  # as it stood, seen along the nozzle
        pointing = transform(upright, nozzle.frame_to_object[:3, 3])
        points = transform_points(inverse(pointing), np.concatenate(target.body.hulls))
        table_m = float(transform_points(target.object_to_world, np.concatenate(target.body.hulls))[:, 2].min())
        paths: list[tuple[bool, HeldPath]] = []
        for _ in range(DRAWN):
            azimuth, roll = rng.uniform(-np.pi, np.pi, 2)
            downward, distance_m = rng.uniform(*DOWNWARD_RAD), rng.uniform(*DISTANCES_M)
            way = np.array([np.cos(azimuth) * np.cos(downward), np.sin(azimuth) * np.cos(downward), -np.sin(downward)])
            rolled = rng.uniform() > UPRIGHT_SHARE
            turn = rotation_of(way) @ Rotation.from_euler("z", roll if rolled else 0.0).as_matrix()
            ends = [center - (distance_m + more) * way for more in np.linspace(FARTHER_M, 0, KNOTS)]
            if ends[-1][2] + float((points @ turn.T)[:, 2].min()) < table_m + LEAST_HEIGHT_M:
                continue
            poses = np.array([transform(turn, end) for end in ends]) @ inverse(pointing)
            paths.append((rolled, HeldPath(poses)))
            if len(paths) == WAYS:
                break
        as_it_stood, turned = (
            tuple(path for rolled, path in paths if rolled == is_rolled) for is_rolled in (False, True)
        )
        grip = grip_of(scene.frames[target.name])

        def rank(grasp: Grasp) -> float | None:
            tips = transform_points(grasp.gripper_to_object, np.array([[0.0, 0, scene.tip_depth_m]]))[0]
            ahead = transform_points(inverse(nozzle.frame_to_object), tips[None])[0]
            if ahead[2] > -FREE_M and np.linalg.norm(ahead[:2]) < nozzle.size_m + FREE_M:
                return None
            return (
                0.0 if grip is None else round(float(np.linalg.norm(tips - grip.frame_to_object[:3, 3])) / NEAR_STEP_M)
            )

        def watch(world: RobotWorld) -> AimWatch:
            return AimWatch(
                target.name,
                aimed_at.name,
                lambda: world.pose_of(target.name) @ nozzle.frame_to_object,
                lambda: transform_points(world.pose_of(aimed_at.name), aimed_at.body.center_of_mass_m[None])[0],
                world.timestep_s,
            )

        return HeldTask(
            as_it_stood,
            rank,
            duration_s=1.0,
            measured=1,
            hold_s=HELD_S,
            ending="put_back",
            otherwise=turned,
            watch=watch,
        )


def nozzle_of(frames: tuple[TwinFrame, ...]) -> TwinFrame | None:
    """Return the first frame whose label means an outlet or a lens."""
    return next((frame for frame in frames if frame.kind in KINDS and is_aiming_label(frame.label)), None)


def grip_of(frames: tuple[TwinFrame, ...]) -> TwinFrame | None:
    """Return the frame at which the object is held: a trigger's, else a grip's, else a handle's or the body's."""
    ranked = [(rank, frame) for frame in frames if (rank := grip_rank(frame.label)) is not None]
    return min(ranked, key=lambda each: each[0])[1] if ranked else None
