"""Skill ``strike``: hit a block with a tool's striking face, level and fastest at contact."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.events import StrikeWatch
from manitwin.episodes.fixtures import Fixture, block
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.planning.closed_hand import open_fingertips
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_skill import HeldSkill
from manitwin.episodes.skills.held_task import GuardedMove, HeldScene, HeldTask
from manitwin.episodes.skills.skill import Surroundings
from manitwin.geometry.frames.label_keywords import is_end_face_label
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.world import RobotWorld
from manitwin.scenes.layouts.pool import Pool, PoolTwin
from manitwin.scenes.layouts.twin_frames import TwinFrame

BLOCK = "block"
ABOVE_M, BELOW_M, FREE_KNOTS = 0.12, 0.03, 6  # the blow starts ABOVE_M above the top and would end BELOW_M below it
ROLLS = 8
FINGERS_BEHIND_M = 0.005
"""Distance of the fingers behind the tool's face: otherwise they touch first, directly or as the tool turns in the hand."""
# grasps whose levers differ by less count as equal: a heavy head turns in a hand that is far from it
LEVER_STEP_M = 0.03
BLOW = GuardedMove(first=0, stop_n=1e-3, duration_s=0.5, beyond=1.7, touches=FREE_KNOTS)
# duration of the whole path at the joint limits, which leaves 0.23 m/s at contact: 1.875 x 0.15 m / 1.2 s
SLOWEST_S = 1.2


class Strike(HeldSkill):
    """Bring the face down on the top of a block, with any heading."""

    name, predicate = "strike", "struck"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a tool with a face labelled as a striking one."""
        return striking_face(target.frames) is not None

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal that the block was struck."""
        return Goal((Literal("struck", target.name, BLOCK),))

    def fixture(self, around: Surroundings, target: int, rng: np.random.Generator) -> Fixture | None:
        """Draw a block in reach."""
        place = around.area.sample_pose(block(np.zeros(3), 0.0).footprint_m, [], rng)
        if place is None:
            return None
        position_m = place[:3, 3] + [0.0, 0, around.area.support.height_m]
        return block(position_m, float(np.arctan2(place[1, 0], place[0, 0])), name=BLOCK)

    def task(self, scene: HeldScene) -> HeldTask:
        """Return the blows, rotated about the vertical in steps of 45 degrees."""
        target, (anvil,) = scene.target, scene.fixtures
        face = striking_face(scene.frames[target.name])
        assert face is not None, "only tools with a striking face strike"
        heights_m = np.array([*np.linspace(ABOVE_M, 0.012, FREE_KNOTS), 0.0, -BELOW_M / 2, -BELOW_M])
        first_rad, paths = scene.rng.uniform(-np.pi, np.pi), []
        for turn in range(ROLLS):
            down = Rotation.from_euler("z", first_rad + turn * 2 * np.pi / ROLLS).as_matrix() @ np.diag([1.0, -1, -1])
            poses = [transform(down, anvil.frame_to_world[:3, 3] + [0.0, 0, each]) for each in heights_m]
            paths.append(HeldPath(np.array(poses) @ inverse(face.frame_to_object), frozenset({BLOCK}), FREE_KNOTS))

        def rank(grasp: Grasp) -> float | None:
            corners = transform_points(grasp.gripper_to_object, open_fingertips(scene.fingertips_m, grasp.width_m))
            if transform_points(inverse(face.frame_to_object), corners)[:, 2].max() > -FINGERS_BEHIND_M:
                return None
            tips = transform_points(grasp.gripper_to_object, np.array([[0.0, 0, scene.tip_depth_m]]))[0]
            lever_m = float(np.linalg.norm(tips - target.body.center_of_mass_m))
            return round(lever_m / LEVER_STEP_M)

        def watch(world: RobotWorld) -> StrikeWatch:
            return StrikeWatch(
                target.name,
                BLOCK,
                lambda: world.pose_of(target.name) @ face.frame_to_object,
                face.size_m,
                world.timestep_s,
            )

        return HeldTask(tuple(paths), rank, longest_s=SLOWEST_S, ending="keep", guard=BLOW, watch=watch)


def striking_face(frames: tuple[TwinFrame, ...]) -> TwinFrame | None:
    """Return the first face labelled as a striking one."""
    faces = (frame for frame in frames if frame.kind == "face" and is_end_face_label(frame.label))
    return next(faces, None)
