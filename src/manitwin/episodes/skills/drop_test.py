"""Drop tests in physics: whether an object released on or in another one comes to rest in a state that satisfies a goal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.goals.evaluation import evaluate
from manitwin.episodes.goals.goal import Goal
from manitwin.episodes.goals.world_state import ObjectState, WorldState
from manitwin.episodes.skills.skill import Surroundings
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import StaticBox
from manitwin.physics.sapien.settle import settle_scene

PERTURBED, OFF_M, OFF_RAD = 3, 0.005, np.radians(3)
SETTLES_S = 2.0
GIVE_UP_M = 0.3  # an object that has moved this far from its release has fallen beside the partner
FLOOR = StaticBox("floor", np.array([1.0, 1.0, 0.25]), transform(translation=np.array([0.0, 0, -0.25])))


def rest_after_drop(
    around: Surroundings, target: int, partner: int, goal: Goal, let_go_at: np.ndarray
) -> np.ndarray | None:
    """Return the target's resting pose ``(4, 4)`` after release at a pose; None if it does not satisfy the goal.

    The scene contains only the two objects and a level floor under the partner.
    """
    moved, base = around.objects[target], around.objects[partner]
    height_m = float(around.parts(partner).bounds[0][2])
    down, up = (transform(translation=np.array([0.0, 0, sign * height_m])) for sign in (-1, 1))
    released = [
        replace(moved, object_to_world=down @ let_go_at),
        replace(base, object_to_world=down @ base.object_to_world),
    ]
    settled = settle_scene(released, [FLOOR], seconds=SETTLES_S, give_up_m=[GIVE_UP_M, GIVE_UP_M])
    states = {
        each.name: ObjectState(each.body, end, each.object_to_world, bool(at_rest), around.body(number).opening)
        for each, end, at_rest, number in zip(
            released, settled.object_to_world, settled.at_rest, (target, partner), strict=True
        )
    }
    touching = frozenset(frozenset(pair) for pair in settled.touching)
    state = WorldState(states, touching, frozenset({FLOOR.name}))
    return up @ settled.object_to_world[0] if evaluate(state, goal).reached else None


def all_drops_succeed(
    around: Surroundings, target: int, partner: int, goal: Goal, let_go_at: Iterable[np.ndarray]
) -> bool:
    """Tell whether the target satisfies the goal at rest after release at each of the poses ``(4, 4)``."""
    return all(rest_after_drop(around, target, partner, goal, pose) is not None for pose in let_go_at)


def perturbed_poses(pose: np.ndarray, rng: np.random.Generator, scale: int = 1) -> Iterator[np.ndarray]:
    """Yield random perturbations of a pose with the errors of a placement; ``scale`` multiplies their size and number."""
    for _ in range(scale * PERTURBED):
        turn = Rotation.from_rotvec(rng.normal(0, scale * OFF_RAD, 3)).as_matrix() @ pose[:3, :3]
        yield transform(turn, pose[:3, 3] + np.array([*rng.normal(0, scale * OFF_M, 2), 0.0]))
