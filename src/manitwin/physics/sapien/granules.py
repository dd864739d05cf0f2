"""Granules: equal spheres in a vessel that represent the contents to pour or stir.

The parameters are measured: at 4 solver iterations PhysX keeps 20 to 240 granules inside thin hulls without tunnelling.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sapien
from sapien import physx
from scipy.spatial import ConvexHull

from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import rotation_between, transform_points
from manitwin.physics.sapien.body import entity_at

GRANULES = 60
FILL_SHARE = 0.16  # share of the vessel's volume to the rim: heaps of dry grains stay below the rim while it is carried
PACKING = 0.55  # packing fraction of spheres that were dropped and not shaken (loose random packing)
RADIUS_M = (0.003, 0.008)
MOST_OF_RIM = 0.2  # of the rim's radius: larger granules jam
FALL_S = 0.6

_DENSITY_KG_M3, _FRICTION, _RESTITUTION = 1000.0, 0.4, 0.1
_LINEAR_DAMPING, _ANGULAR_DAMPING = 0.05, 1.0  # per s; spheres would otherwise roll forever
_OFFSET_SHARE = 0.2  # contact offset over the radius
# faster depenetration shoots granules pressed against a wall out of the vessel
_ITERATIONS, _MAX_DEPENETRATION_M_S = 4, 0.5
_SPACING = 2.15  # lattice spacing in radii
_WIDTH_SHARE = 0.8  # lattice radius over the rim's radius


@dataclass(frozen=True)
class GranuleFill:
    """Initial granules: their centres ``(N, 3)`` m in the frame of the vessel ``name``, and their radius (m)."""

    name: str
    centers_m: np.ndarray
    radius_m: float

    @property
    def volume_m3(self) -> float:
        """Volume of the granules as a heap, voids included, m^3."""
        return float(len(self.centers_m) * 4 / 3 * np.pi * self.radius_m**3 / PACKING)


def create_granule_fill(
    name: str, opening: Opening, hulls: Sequence[np.ndarray], rng: np.random.Generator
) -> GranuleFill | None:
    """Return 60 granules for a vessel, or fewer if they would be too small; None if it has no room for ten.

    They fill ``FILL_SHARE`` of its volume and start in a loose lattice above its floor, clear of its ``hulls``, each
    ``(V, 3)`` m.
    """
    content_m3 = FILL_SHARE * PACKING * opening.volume_m3
    most_m = min(RADIUS_M[1], MOST_OF_RIM * opening.rim_radius_m)
    radius_m = float(np.clip(np.cbrt(content_m3 / (GRANULES * 4 / 3 * np.pi)), RADIUS_M[0], most_m))
    count = min(GRANULES, int(content_m3 / (4 / 3 * np.pi * radius_m**3)) + 1)
    if most_m < RADIUS_M[0] or count < 10:
        return None
    centers_m = _lattice(opening, hulls, count, radius_m, rng)
    return None if centers_m is None else GranuleFill(name, centers_m, radius_m)


def _lattice(
    opening: Opening, hulls: Sequence[np.ndarray], count: int, radius_m: float, rng: np.random.Generator
) -> np.ndarray | None:
    """Fill layers from the bottom, each in random order, up to ``count``; None if they would rise too far above the rim."""
    wide_m, step_m = max(_WIDTH_SHARE * opening.rim_radius_m - radius_m, 1.01 * radius_m), _SPACING * radius_m
    planes = [ConvexHull(hull).equations for hull in hulls]
    to_object = rotation_between(np.array([0.0, 0, 1]), opening.axis)
    reach = int(wide_m // step_m) + 1
    flat = np.arange(-reach, reach + 1) * step_m
    layer = np.stack(np.meshgrid(flat, flat, indexing="ij"), axis=-1).reshape(-1, 2)
    layer = layer[np.hypot(*layer.T) <= wide_m]
    found: list[np.ndarray] = []
    missing, height_m = count, -opening.depth_m + 1.5 * radius_m
    while missing > 0:
        if height_m > opening.depth_m:
            return None
        points = np.column_stack([layer, np.full(len(layer), height_m)])[rng.permutation(len(layer))]
        points = points @ to_object.T + opening.center_m
        free = np.ones(len(points), bool)
        for each in planes:
            free &= ~_within(points, each, radius_m)
        found.append(points[free][:missing])
        missing -= len(found[-1])
        height_m += step_m
    shaken = rng.uniform(-0.05 * radius_m, 0.05 * radius_m, (count, 3))
    return np.concatenate(found) + shaken


def _within(points: np.ndarray, planes: np.ndarray, radius_m: float) -> np.ndarray:
    """Tell which spheres overlap a hull, given the planes ``(F, 4)`` of its faces."""
    return np.asarray((points @ planes[:, :3].T + planes[:, 3]).max(1) < 1.02 * radius_m)


class Granules:
    """Bodies of granules, as entities not yet in a scene."""

    def __init__(self, fill: GranuleFill, vessel_to_world: np.ndarray):
        """Place the granules above the floor of their vessel at its pose ``(4, 4)``."""
        self.radius_m = fill.radius_m
        material = physx.PhysxMaterial(_FRICTION, _FRICTION, _RESTITUTION)
        centers_m = transform_points(vessel_to_world, fill.centers_m)
        self._bodies = [_granule(fill.radius_m, material) for _ in centers_m]
        self.entities = [
            entity_at(body, sapien.Pose(center), "granule")
            for body, center in zip(self._bodies, centers_m, strict=True)
        ]

    def positions_m(self) -> np.ndarray:
        """Return the centres ``(N, 3)`` m in the world frame."""
        return np.array([body.entity_pose.p for body in self._bodies], float)


def _granule(radius_m: float, material: physx.PhysxMaterial) -> physx.PhysxRigidDynamicComponent:
    shape = physx.PhysxCollisionShapeSphere(radius_m, material)
    shape.density, shape.contact_offset = _DENSITY_KG_M3, _OFFSET_SHARE * radius_m
    body = physx.PhysxRigidDynamicComponent()
    body.attach(shape)
    body.solver_position_iterations, body.solver_velocity_iterations = _ITERATIONS, 1
    body.max_depenetration_velocity = _MAX_DEPENETRATION_M_S
    body.set_linear_damping(_LINEAR_DAMPING)
    body.set_angular_damping(_ANGULAR_DAMPING)
    return body
