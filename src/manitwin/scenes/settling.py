"""Let all objects of a scene come to rest together in SAPIEN, and say who touches whom."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.placed_object import PlacedObject, StaticBox
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.sapien.body import dynamic_component, hull_shapes
from manitwin.physics.sapien.physx_system import scene_with_gravity
from manitwin.scenes.sapien_scene import CONTACT_OFFSET_M, SOLVER_ITERATIONS, static_entity

# As in physics/sapien/settle.py, where each was measured.
TIMESTEP_S = 1 / 240
CHECK_EVERY = 12  # steps between looks at whether all is still
STILL_LOOKS = 3  # one slow look can be a turning point
STILL_M_S, STILL_RAD_S = 1e-3, 1e-2
TOUCHING_M = 5e-4  # solvers leave a gap of some tenths of a millimetre where there is weight on it
KEPT_BODIES = 256


@dataclass(frozen=True)
class SettledScene:
    """Where everything came to rest.

    ``object_to_world (N, 4, 4)``, ``at_rest (N,)``; ``lost (N,)`` went so far that the rest was not waited for. ``touching``
    are pairs of names (objects and boxes) that press on each other, the earlier added first, with the deepest overlap (m, 0
    where none) that the solver has left between them.
    """

    object_to_world: np.ndarray
    at_rest: np.ndarray
    lost: np.ndarray
    touching: dict[tuple[str, str], float]
    steps: int

    def neighbours(self, name: str) -> set[str]:
        """Return what touches an object."""
        return {other for pair in self.touching if name in pair for other in pair if other != name}


class CookedHulls:
    """Collision shapes of bodies, kept for the next scene: cooking costs more than stepping.

    A shape belongs to one scene at a time, so only one scene at a time may use them; the bodies used last are kept.
    """

    def __init__(self) -> None:
        self._kept: dict[int, tuple[RigidBody, list[list[physx.PhysxCollisionShapeConvexMesh]]]] = {}
        self._taken: Counter[int] = Counter()

    def begin(self) -> None:
        """Say that the scene before is gone."""
        self._taken.clear()
        while len(self._kept) > KEPT_BODIES:
            del self._kept[next(iter(self._kept))]

    def take(self, body: RigidBody) -> list[physx.PhysxCollisionShapeConvexMesh]:
        """Return shapes of a body that nobody in this scene has; the same body may be there more than once."""
        key = id(body)
        sets = self._kept.pop(key, (body, []))[1]
        self._kept[key] = (body, sets)  # now the last one to go
        if self._taken[key] == len(sets):
            sets.append(hull_shapes(body.hulls))
        self._taken[key] += 1
        return sets[self._taken[key] - 1]


_COOKED = CookedHulls()


def settle_scene(
    objects: Sequence[PlacedObject],
    boxes: Sequence[StaticBox],
    *,
    seconds: float,
    at_least_s: float = 0.0,
    give_up_m: Sequence[float] | None = None,
) -> SettledScene:
    """Release all objects at their poses at once; ends when all are still, not before ``at_least_s`` nor after ``seconds``.

    ``give_up_m`` is how far the origin of each may move before the rest is not worth waiting for.
    """
    scene = scene_with_gravity(TIMESTEP_S)
    _COOKED.begin()
    names: dict[int, str] = {}
    for box in boxes:
        entity = static_entity(box, contact_offset_m=CONTACT_OFFSET_M)
        scene.add_entity(entity)
        names[entity.per_scene_id] = box.name
    bodies = []
    for placed in objects:
        component = dynamic_component(placed.body, _COOKED.take(placed.body), contact_offset_m=CONTACT_OFFSET_M)
        component.set_solver_position_iterations(SOLVER_ITERATIONS)
        component.set_angular_damping(0.0)
        component.set_sleep_threshold(0.0)  # what sleeps reports no contacts
        entity = sapien.Entity()
        entity.add_component(component)
        pose = placed.object_to_world
        entity.pose = sapien.Pose(pose[:3, 3], quaternion_wxyz(pose[:3, :3]))
        scene.add_entity(entity)
        names[entity.per_scene_id] = placed.name
        bodies.append(component)
    limits_m = np.full(len(bodies), np.inf) if give_up_m is None else np.array(give_up_m, dtype=float)
    looks, lost, steps = _step_until_still(
        scene, bodies, round(at_least_s / TIMESTEP_S), round(seconds / TIMESTEP_S), limits_m
    )
    return SettledScene(_poses(bodies), looks > 0, lost, _touching(scene, names), steps)


def _step_until_still(
    scene: sapien.Scene, bodies: list[physx.PhysxRigidDynamicComponent], least: int, most: int, give_up_m: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    """Step; return for how many looks in a row each body has been still, which went too far, and the steps.

    Still is judged by where a body got between two looks: at rest on many hulls, its velocity of one step is noise.
    """
    looks, lost = np.zeros(len(bodies), dtype=int), np.zeros(len(bodies), dtype=bool)
    start = before = _poses(bodies)
    step = scene.physx_system.step
    between_s = CHECK_EVERY * TIMESTEP_S
    for done in count(1):
        step()
        if done % CHECK_EVERY == 0:
            now = _poses(bodies)
            moved = np.linalg.norm(now[:, :3, 3] - before[:, :3, 3], axis=1)
            turned = np.linalg.norm(now[:, :3, :3] - before[:, :3, :3], axis=(1, 2)) / np.sqrt(
                2
            )  # |R - I| for small angles
            still = (moved < STILL_M_S * between_s) & (turned < STILL_RAD_S * between_s)
            looks, before = np.where(still, looks + 1, 0), now
            lost = np.linalg.norm((now - start)[:, :3, 3], axis=1) > give_up_m
            if (done >= least and (looks >= STILL_LOOKS).all()) or lost.any():
                break
        if done >= most:
            break
    return looks, lost, done


def _poses(bodies: list[physx.PhysxRigidDynamicComponent]) -> np.ndarray:
    return np.array([body.entity_pose.to_transformation_matrix() for body in bodies], dtype=float).reshape(-1, 4, 4)


def _touching(scene: sapien.Scene, names: dict[int, str]) -> dict[tuple[str, str], float]:
    found: dict[tuple[str, str], float] = {}
    for contact in scene.physx_system.get_contacts():
        separation = min((point.separation for point in contact.points), default=np.inf)
        pressed = any(np.linalg.norm(point.impulse) > 0 for point in contact.points)
        if separation > TOUCHING_M and not pressed:
            continue
        first, second = sorted(body.entity.per_scene_id for body in contact.bodies)
        pair = names[first], names[second]
        found[pair] = max(found.get(pair, 0.0), -float(separation), 0.0)
    return dict(sorted(found.items()))
