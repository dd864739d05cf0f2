"""Let a body come to rest on a plane, and let a ball drop into a vessel, in SAPIEN."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import quaternion_wxyz, rotation_between, transform_points
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.convex_shape import convex_shape
from manitwin.physics.sapien.body import dynamic_component, hull_shapes
from manitwin.physics.sapien.physx_system import scene_with_gravity

_TIMESTEP_S = 1 / 240
_SOLVER_ITERATIONS = 20  # at PhysX's own 4 to 10, stacks of hulls creep
_CONTACT_OFFSET_M = 0.002  # 10 mm costs 1.6 times as much for the same answer
_CHECK_EVERY = 12  # steps between looks at whether all is still
_STILL_M_S = 1e-3
_STILL_RAD_S = 1e-2
_BALL_TIMESTEP_S = 1 / 480


@dataclass(frozen=True)
class Settled:
    """Where a body came to: its pose, how far its centre of mass moved and it turned, and whether it had come to rest.

    The drop itself does not count as having moved.
    """

    object_to_plane: np.ndarray
    moved_m: float
    turned_rad: float
    at_rest: bool


def settle_on_plane(
    body: RigidBody, object_to_plane: Sequence[np.ndarray], *, drop_m: float, seconds: float
) -> list[Settled]:
    """Release a body ``drop_m`` above the plane z = 0 in each of several poses (4x4), and see where it comes to rest.

    No poses, nothing to do. All copies share one scene, far enough apart never to meet. Ends when all are still,
    after ``seconds`` at the latest.
    """
    if not len(object_to_plane):
        return []
    scene = scene_with_gravity(_TIMESTEP_S)
    material = physx.PhysxMaterial(body.friction_static, body.friction_dynamic, 0.0)
    _add_ground(scene, material)
    reach = max(float(np.linalg.norm(hull - body.center_of_mass_m, axis=1).max()) for hull in body.hulls)
    spacing = 8 * reach + 1.0
    offsets = [np.array([spacing * i, 0.0, drop_m]) for i in range(len(object_to_plane))]
    bodies = []
    for pose, offset in zip(object_to_plane, offsets, strict=True):
        component = dynamic_component(body, hull_shapes(body.hulls), contact_offset_m=_CONTACT_OFFSET_M)
        component.set_solver_position_iterations(_SOLVER_ITERATIONS)
        component.set_angular_damping(0.0)
        _add(scene, component, sapien.Pose(pose[:3, 3] + offset, quaternion_wxyz(pose[:3, :3])))
        bodies.append(component)
    still = [0] * len(bodies)
    for step in range(round(seconds / _TIMESTEP_S)):
        scene.step()
        if (step + 1) % _CHECK_EVERY:
            continue
        still = [count + 1 if _is_still(component) else 0 for count, component in zip(still, bodies, strict=True)]
        if min(still) >= 3:  # one slow look can be a turning point
            break
    drop = np.array([0, 0, drop_m])
    return [
        _outcome(body, pose, component.entity.pose, offset - drop, drop, bool(count))
        for pose, component, offset, count in zip(object_to_plane, bodies, offsets, still, strict=True)
    ]


def ball_stays_inside(hulls: Sequence[np.ndarray], opening: Opening, *, seconds: float = 2.0) -> bool:
    """Drop a ball that fits into an opening and tell whether it goes in and stays there.

    The ball's radius is a third of the rim's or of the depth, whichever is less. It starts above the middle of the
    rim; the vessel stands fixed with its opening up. In means: its centre ends below the brim, no more than the depth
    below it, and no farther from the axis than the vessel's widest point.
    """
    axis = opening.axis
    along = [float((hull @ axis).max()) for hull in hulls]
    radius = min(opening.rim_radius_m, opening.depth_m) / 3
    scene = scene_with_gravity(_BALL_TIMESTEP_S)
    up = np.array([0.0, 0, 1])
    turn = rotation_between(axis, up)
    material = physx.PhysxMaterial(0.5, 0.5, 0.0)
    vessel = physx.PhysxRigidStaticComponent()
    for hull in hulls:
        wall = convex_shape(hull, material)
        wall.contact_offset = _CONTACT_OFFSET_M
        vessel.attach(wall)
    _add(scene, vessel, sapien.Pose([0, 0, 0], quaternion_wxyz(turn)))
    ball = physx.PhysxRigidDynamicComponent()
    shape = physx.PhysxCollisionShapeSphere(radius, material)
    shape.contact_offset = min(_CONTACT_OFFSET_M, radius / 4)
    ball.attach(shape)
    ball.set_mass(0.01)
    ball.set_inertia(np.full(3, 0.4 * 0.01 * radius**2, dtype=np.float32))
    ball.set_linear_damping(1.0)  # takes the bouncing out: only where it ends counts
    rim = turn @ opening.center_m
    start = rim + up * (max(along) - float(opening.center_m @ axis) + 1.5 * radius)
    _add(scene, ball, sapien.Pose(start))
    for _ in range(round(seconds / _BALL_TIMESTEP_S)):
        scene.step()
    end = np.asarray(ball.entity.pose.p, dtype=float)
    widest = max(float(np.linalg.norm((hull @ turn.T - rim)[:, :2], axis=1).max()) for hull in hulls)
    below_brim = rim[2] - end[2]
    return bool(0 < below_brim <= opening.depth_m and np.linalg.norm((end - rim)[:2]) < widest)


def _add(scene: sapien.Scene, component: physx.PhysxRigidBaseComponent, pose: sapien.Pose) -> None:
    entity = sapien.Entity()
    entity.add_component(component)
    entity.pose = pose
    scene.add_entity(entity)


def _add_ground(scene: sapien.Scene, material: physx.PhysxMaterial) -> None:
    ground = physx.PhysxRigidStaticComponent()
    ground.attach(physx.PhysxCollisionShapePlane(material))
    half = float(np.sqrt(0.5))
    _add(scene, ground, sapien.Pose([0, 0, 0], [half, 0, -half, 0]))  # PhysX planes face +X


def _is_still(component: physx.PhysxRigidDynamicComponent) -> bool:
    linear, angular = np.linalg.norm(component.linear_velocity), np.linalg.norm(component.angular_velocity)
    return bool(component.is_sleeping or (linear < _STILL_M_S and angular < _STILL_RAD_S))


def _outcome(
    body: RigidBody, start: np.ndarray, end: sapien.Pose, offset: np.ndarray, drop: np.ndarray, at_rest: bool
) -> Settled:
    pose = np.asarray(end.to_transformation_matrix(), dtype=float)
    pose[:3, 3] -= offset
    before, after = (transform_points(p, body.center_of_mass_m[None])[0] for p in (start, pose))
    cosine = (np.trace(pose[:3, :3] @ start[:3, :3].T) - 1) / 2
    return Settled(pose, float(np.linalg.norm(after - before)), float(np.arccos(np.clip(cosine, -1, 1))), at_rest)
