"""Settling in SAPIEN: copies of a body on a plane, a scene of bodies on furniture, and a ball in a vessel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import quaternion_wxyz, transform_points
from manitwin.geometry.rigid_body import PlacedObject, RigidBody, StaticBox
from manitwin.physics.ball_drop import BALL_KG, BALL_SECONDS, BallDrop
from manitwin.physics.sapien.body import (
    CONTACT_OFFSET_M,
    SOLVER_ITERATIONS,
    dynamic_component,
    entity_at,
    iterations_beside,
    static_box,
    static_plane,
)
from manitwin.physics.sapien.scene import scene_with_gravity
from manitwin.physics.sapien.shapes import COOKED, HullShapes, convex_shape, hull_shapes, set_contact

TIMESTEP_S = 1 / 240
TOUCHING_M = 5e-4  # solvers leave a gap of some tenths of a millimetre under load
_BALL_TIMESTEP_S = 1 / 480


@dataclass(frozen=True)
class RestLimits:
    """Criterion of rest: both speeds below their limits for ``looks`` consecutive checks.

    Speeds are mean speeds between two checks, because the instantaneous velocity of a body at rest on many hulls is noisy.
    ``by_velocity`` uses the velocities after the last step instead.
    """

    speed_m_s: float = 1e-3
    turn_rad_s: float = 1e-2
    between_s: float = 0.05
    looks: int = 3  # a single slow check can be a turning point
    by_velocity: bool = False


class RestWatch:
    """Determines by repeated checks which bodies have come to rest."""

    def __init__(self, bodies: Sequence[physx.PhysxRigidDynamicComponent], limits: RestLimits):
        """Record the initial poses, from which motions are measured."""
        self._bodies, self._limits = bodies, limits
        self.start = self._before = poses_of(bodies)
        self.looks = np.zeros(len(bodies), dtype=int)

    @property
    def all_rest(self) -> bool:
        """Whether every body has been still for the required number of checks."""
        return bool((self.looks >= self._limits.looks).all())

    def look(self) -> np.ndarray:
        """Check again, ``between_s`` after the last check; return the poses ``(N, 4, 4)``."""
        now, limits = poses_of(self._bodies), self._limits
        speed_m_s, turn_rad_s = self._last_speeds() if limits.by_velocity else self._mean_speeds(now)
        still = (speed_m_s < limits.speed_m_s) & (turn_rad_s < limits.turn_rad_s)
        self.looks, self._before = np.where(still, self.looks + 1, 0), now
        return now

    def _mean_speeds(self, now: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        moved_m = np.linalg.norm((now - self._before)[:, :3, 3], axis=1)
        turned_rad = np.linalg.norm((now - self._before)[:, :3, :3], axis=(1, 2)) / np.sqrt(
            2
        )  # |R - I| = sqrt(2) angle for small angles
        return moved_m / self._limits.between_s, turned_rad / self._limits.between_s

    def _last_speeds(self) -> tuple[np.ndarray, np.ndarray]:
        return (
            np.array([np.linalg.norm(body.linear_velocity) for body in self._bodies]),
            np.array([np.linalg.norm(body.angular_velocity) for body in self._bodies]),
        )


@dataclass(frozen=True)
class RestState:
    """Bodies after settling: ``object_to_world (N, 4, 4)``, ``at_rest (N,)``, and the number of steps.

    ``lost (N,)`` marks bodies that moved so far that settling was aborted.
    """

    object_to_world: np.ndarray
    at_rest: np.ndarray
    lost: np.ndarray
    steps: int


def settle(
    system: physx.PhysxCpuSystem,
    bodies: Sequence[physx.PhysxRigidDynamicComponent],
    *,
    timestep_s: float,
    seconds: float,
    at_least_s: float = 0.0,
    limits: RestLimits = RestLimits(),
    give_up_m: Sequence[float] | None = None,
) -> RestState:
    """Step until all bodies are at rest, for at least ``at_least_s`` and at most ``seconds``.

    ``give_up_m`` is the displacement of each body's origin at which settling is aborted.
    """
    watch, lost = RestWatch(bodies, limits), np.zeros(len(bodies), dtype=bool)
    limits_m = np.full(len(bodies), np.inf) if give_up_m is None else np.array(give_up_m, dtype=float)
    least, most, between = (round(time_s / timestep_s) for time_s in (at_least_s, seconds, limits.between_s))
    between = max(1, between)
    done = 0
    while done < most:
        system.step()
        done += 1
        if done % between == 0:
            now = watch.look()
            lost = np.linalg.norm((now - watch.start)[:, :3, 3], axis=1) > limits_m
            if (done >= least and watch.all_rest) or lost.any():
                break
    return RestState(poses_of(bodies), watch.looks > 0, lost, done)


@dataclass(frozen=True)
class SettledBody:
    """A body after it was set down: pose, displacement of its centre of mass, and whether it is at rest.

    The displacement is relative to the pose without the drop height.
    """

    object_to_plane: np.ndarray
    moved_m: float
    at_rest: bool

    @staticmethod
    def of(body: RigidBody, start: np.ndarray, end: np.ndarray, at_rest: bool) -> SettledBody:
        """Return the result for the initial and final pose ``(4, 4)`` of the object frame."""
        before, after = (transform_points(p, body.center_of_mass_m[None])[0] for p in (start, end))
        return SettledBody(end, float(np.linalg.norm(after - before)), at_rest)


def settle_on_plane(
    body: RigidBody,
    object_to_plane: Sequence[np.ndarray],
    *,
    drop_m: float,
    seconds: float,
    timestep_s: float = TIMESTEP_S,
) -> list[SettledBody]:
    """Release a body ``drop_m`` above the plane z = 0 in each of several poses ``(4, 4)`` and simulate until it rests.

    All copies share one scene, far enough apart never to touch. Ends when all are at rest, after ``seconds`` at the latest.
    Returns an empty list for no poses.
    """
    if not len(object_to_plane):
        return []
    scene = scene_with_gravity(timestep_s)
    scene.add_entity(static_plane(body.friction_static, body.friction_dynamic))
    reach = max(float(np.linalg.norm(hull - body.center_of_mass_m, axis=1).max()) for hull in body.hulls)
    spacing = 8 * reach + 1.0
    offsets = [np.array([spacing * i, 0.0, drop_m]) for i in range(len(object_to_plane))]
    # Copies may sleep, which takes a fifth of the time: contacts are not read, and the 25 test objects rest the same without
    # sleeping.
    bodies = [
        _release(scene, body, hull_shapes(body.hulls), pose[:3, 3] + offset, pose[:3, :3], may_sleep=True)
        for pose, offset in zip(object_to_plane, offsets, strict=True)
    ]
    rest = settle(scene.physx_system, bodies, timestep_s=timestep_s, seconds=seconds)
    rest.object_to_world[:, :2, 3] -= np.array(offsets)[:, :2]
    return [
        SettledBody.of(body, pose, end, bool(at_rest))
        for pose, end, at_rest in zip(object_to_plane, rest.object_to_world, rest.at_rest, strict=True)
    ]


@dataclass(frozen=True)
class SettledScene(RestState):
    """A scene after its objects came to rest.

    ``touching`` maps pairs of names (objects and boxes) in contact, in order of addition, to the deepest overlap (m, 0 if
    none) that the solver has left between them.
    """

    touching: dict[tuple[str, str], float]

    def neighbours(self, name: str) -> set[str]:
        """Return the names of all objects and boxes in contact with ``name``."""
        return {other for pair in self.touching if name in pair for other in pair if other != name}


def settle_scene(
    objects: Sequence[PlacedObject],
    boxes: Sequence[StaticBox],
    *,
    seconds: float,
    at_least_s: float = 0.0,
    give_up_m: Sequence[float] | None = None,
) -> SettledScene:
    """Release all objects at their poses at once, and simulate until they rest.

    ``seconds``, ``at_least_s`` and ``give_up_m`` are those of ``settle``.
    """
    scene = scene_with_gravity(TIMESTEP_S)
    names: dict[int, str] = {}
    for box in boxes:
        entity = static_box(box, contact_offset_m=CONTACT_OFFSET_M)
        scene.add_entity(entity)
        names[entity.per_scene_id] = box.name
    with COOKED.lent([placed.body.hulls for placed in objects]) as shapes:
        bodies, counts = [], iterations_beside([each.body.mass_kg for each in objects], SOLVER_ITERATIONS)
        for placed, own, count in zip(objects, shapes, counts, strict=True):
            pose = placed.object_to_world
            # sleeping bodies report no contacts
            component = _release(scene, placed.body, own, pose[:3, 3], pose[:3, :3], may_sleep=False)
            component.set_solver_position_iterations(count)
            names[component.entity.per_scene_id] = placed.name
            bodies.append(component)
        rest = settle(
            scene.physx_system,
            bodies,
            timestep_s=TIMESTEP_S,
            seconds=seconds,
            at_least_s=at_least_s,
            give_up_m=give_up_m,
        )
        return SettledScene(**vars(rest), touching=_touching(scene, names))


def _release(
    scene: sapien.Scene,
    body: RigidBody,
    shapes: HullShapes,
    position_m: np.ndarray,
    rotation: np.ndarray,
    *,
    may_sleep: bool,
) -> physx.PhysxRigidDynamicComponent:
    component = dynamic_component(body, shapes, contact_offset_m=CONTACT_OFFSET_M)
    component.set_solver_position_iterations(SOLVER_ITERATIONS)
    component.set_angular_damping(0.0)
    if not may_sleep:
        component.set_sleep_threshold(0.0)
    scene.add_entity(entity_at(component, sapien.Pose(position_m, quaternion_wxyz(rotation))))
    return component


def poses_of(bodies: Sequence[physx.PhysxRigidDynamicComponent]) -> np.ndarray:
    """Return the poses ``(N, 4, 4)`` of bodies."""
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


def ball_stays_inside(hulls: Sequence[np.ndarray], opening: Opening, *, seconds: float = BALL_SECONDS) -> bool:
    """Drop a ball that fits into an opening and tell whether it ends inside (``BallDrop``)."""
    drop = BallDrop.of(hulls, opening)
    scene = scene_with_gravity(_BALL_TIMESTEP_S)
    material = physx.PhysxMaterial(0.5, 0.5, 0.0)
    vessel = physx.PhysxRigidStaticComponent()
    for hull in hulls:
        wall = convex_shape(hull, material)
        set_contact(wall, contact_offset_m=CONTACT_OFFSET_M)
        vessel.attach(wall)
    scene.add_entity(entity_at(vessel, sapien.Pose([0, 0, 0], quaternion_wxyz(drop.turn))))
    ball = physx.PhysxRigidDynamicComponent()
    shape = physx.PhysxCollisionShapeSphere(drop.radius_m, material)
    set_contact(shape, contact_offset_m=min(CONTACT_OFFSET_M, drop.radius_m / 4))
    ball.attach(shape)
    ball.set_mass(BALL_KG)
    ball.set_inertia(np.full(3, 0.4 * BALL_KG * drop.radius_m**2, dtype=np.float32))
    ball.set_linear_damping(1.0)  # damps bouncing: only the final position counts
    scene.add_entity(entity_at(ball, sapien.Pose(drop.start_m)))
    for _ in range(round(seconds / _BALL_TIMESTEP_S)):
        scene.step()
    return drop.is_inside(np.asarray(ball.entity.pose.p, dtype=float))
