"""Skill ``wipe``: move a sponge, a brush or an eraser over a board in rows, with its face pressing at a controlled force."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.fixtures import Fixture
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_skill import HeldSkill, board_in_reach
from manitwin.episodes.skills.held_task import ForceControlledMove, GuardedMove, HeldScene, HeldTask
from manitwin.episodes.skills.skill import Surroundings
from manitwin.episodes.tool_watches import FACE_M, WIPING_N, WipeWatch
from manitwin.geometry.frames.label_keywords import is_wiping_face
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.world import RobotWorld
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose
from manitwin.scenes.layouts.twin_frames import TwinFrame

BOARD, PATCH = "wiping_board", "patch"
BOARD_HALF_M, PATCH_HALF_M = np.array([0.10, 0.08, 0.02]), np.array([0.06, 0.04])
LEAST_RADIUS_M, LEAST_THICK_M = 0.01, 0.015  # a centimetre of contact for the pads, and their clearance above the board
WIPED_N = float(np.mean(WIPING_N))
ABOVE_M, BELOW_M, FREE_KNOTS, DESCENT_KNOTS = 0.05, 0.003, 4, 4
DESCENT_M_S, STROKE_M_S = 0.004, 0.06
OVERLAP = 0.8  # row spacing over the face's width
STEP_M = 0.01
FINGERS_BEHIND_M = 0.003  # distance of the fingers behind the wiping face


class Wipe(HeldSkill):
    """Lower the face until it presses, move it over the patch in rows under force control, and put the object back."""

    name, predicate = "wipe", "wiped"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept an object at least 15 mm thick behind a wiping face: any face of a sponge or soap, the bristles of a brush."""
        points = pool.body(target.twin_id).parts.whole
        return any(
            is_wiping_face(target.category, face.label)
            and np.ptp(points @ face.frame_to_object[:3, 2]) >= LEAST_THICK_M
            for face in wiping_faces(target.frames)
        )

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal that the patch was wiped."""
        return Goal((Literal(self.predicate, target.name, PATCH),))

    def begins_in(self, target: PoolTwin) -> list[StandingPose]:
        """Return the likeliest placement with a wiping face downwards, otherwise the likeliest."""
        faces = wiping_faces(target.frames)

        def down(pose: StandingPose) -> bool:
            return any((pose.object_to_plane @ face.frame_to_object)[2, 2] < -0.9 for face in faces)

        return [max(target.poses, key=lambda pose: (down(pose), pose.probability))]

    def fixture(self, around: Surroundings, target: int, rng: np.random.Generator) -> Fixture | None:
        """Draw a board in reach."""
        return board_in_reach(around, BOARD_HALF_M, BOARD, rng)

    def task(self, scene: HeldScene) -> HeldTask:
        """Return the rows over the patch with each face, the lowest face first, at four headings, from either end."""
        target, (under,) = scene.target, scene.fixtures
        points, faces = np.concatenate(target.body.hulls), wiping_faces(scene.frames[target.name])
        faces = tuple(sorted(faces, key=lambda face: (target.object_to_world @ face.frame_to_object)[2, 2]))
        paths, patch = [], under.frame_to_world
        for face, turn, end in product(faces, range(4), (1.0, -1.0)):
            down = Rotation.from_euler("z", turn * np.pi / 2).as_matrix() @ np.diag([1.0, -1, -1])
            local = transform_points(transform(down) @ inverse(face.frame_to_object), points)
            flat = local[local[:, 2] < local[:, 2].min() + FACE_M]
            middle, half_m = (flat.max(0) + flat.min(0)) / 2, np.ptp(flat, axis=0)[:2] / 2
            rows = _rows(half_m) * [end, 1.0]
            at = np.column_stack([rows - middle[:2], np.full(len(rows), -local[:, 2].min())])
            heights_m = [*np.linspace(ABOVE_M, BELOW_M, FREE_KNOTS), *np.linspace(0.001, -BELOW_M, DESCENT_KNOTS)]
            places = np.concatenate([at[0] + np.array([[0.0, 0, each]]) for each in heights_m] + [at])
            poses = np.array([patch @ transform(down, place) for place in places]) @ inverse(face.frame_to_object)
            paths.append(HeldPath(poses, frozenset({BOARD}), FREE_KNOTS))
        first = FREE_KNOTS + DESCENT_KNOTS

        def rank(grasp: Grasp) -> float | None:
            tips = transform_points(grasp.gripper_to_object, scene.fingertips_m)
            behind_m = max(float(-transform_points(inverse(f.frame_to_object), tips)[:, 2].max()) for f in faces)
            return None if behind_m < FINGERS_BEHIND_M else 0.0

        def watch(world: RobotWorld) -> WipeWatch:
            frames = np.array([face.frame_to_object for face in faces])
            return WipeWatch(
                target.name, BOARD, PATCH, patch, PATCH_HALF_M, points, lambda: world.pose_of(target.name), frames
            )

        return HeldTask(
            tuple(paths),
            rank,
            duration_s=1.0,
            longest_s=15.0,
            measured=1,
            ending="put_back",
            guard=GuardedMove(FREE_KNOTS, WIPING_N[0], speed_m_s=DESCENT_M_S),
            regulated=ForceControlledMove(first, WIPED_N, patch[:3, 2], STROKE_M_S),
            rises=True,
            watch=watch,
        )


def wiping_faces(frames: tuple[TwinFrame, ...]) -> tuple[TwinFrame, ...]:
    """Return the faces that are large enough."""
    return tuple(frame for frame in frames if frame.kind == "face" and frame.size_m >= LEAST_RADIUS_M)


def _rows(half_m: np.ndarray) -> np.ndarray:
    """Return positions ``(N, 2)`` of a face's centre, 1 cm apart, on a boustrophedon path over the patch."""
    reach_m = np.maximum(PATCH_HALF_M - half_m, 0.0)
    reach_m = np.where(reach_m > 0, reach_m + np.minimum(STEP_M, half_m / 2), 0.0)
    reach_m[0] = max(reach_m[0], 0.03)
    count = 1 + int(np.ceil(2 * reach_m[1] / (OVERLAP * 2 * half_m[1])))
    corners = []
    for number, across_m in enumerate(np.linspace(-reach_m[1], reach_m[1], count) if count > 1 else [0.0]):
        ends = [[-reach_m[0], across_m], [reach_m[0], across_m]]
        corners += ends if number % 2 == 0 else ends[::-1]
    if count == 1:
        corners.append(corners[0])
    ways = [np.array(corners[:1])]
    for start, stop in zip(np.array(corners)[:-1], np.array(corners)[1:], strict=True):
        steps = max(2, int(np.ceil(np.linalg.norm(stop - start) / STEP_M)) + 1)
        ways.append(np.linspace(start, stop, steps)[1:])
    return np.concatenate(ways)
