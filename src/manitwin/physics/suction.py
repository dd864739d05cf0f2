"""Contact model of a suction cup: whether its lip seals on a surface, and the load that a sealed lip can carry.

The lip's ring is projected onto the surface along the approach, and the deformation that the cup needs to follow the surface
is bounded. This is the idea of Dex-Net 3.0's quasi-static spring model (Mahler et al., ICRA 2018, section IV-A), with bounds
in the units of a cup's data sheet (tilt of the bellows, bending of the lip, surface angle) instead of one strain limit for
all springs.

The sealed lip presses on the surface with N = V - T: the vacuum force V less the pull T along the lip's axis. It holds if

- friction carries shear and twist: hypot(S, M_n / r) <= mu N, the limit surface of Howe and Cutkosky (1996) as an ellipsoid,
  whose twist limit mu N r is exact for a thin ring;
- the lip stays pressed on all around: M_t <= N r / 2, where the pressure of a thin elastic ring, N / (2 pi r) (1 + a cos)
  with M_t = a N r / 2, becomes zero at one edge.

The first condition is that of Dex-Net 3.0 (section IV-B) without its linearisation. The second replaces its elastic moment
limit, which needs a material constant of the cup. Both conditions are linear in the load: they read
``(S / mu + T) / V <= 1`` and ``(2 M_t / r + T) / V <= 1``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.geometry.ray_caster import RayCaster
from manitwin.robots.grippers.suction import SuctionGripper

RING_POINTS = 32  # 3 mm apart on a lip of 15 mm radius: narrower gaps are not detected
INNER_RINGS = ((1, 0.0), (8, 1 / 3), (12, 2 / 3))  # number of points and share of the lip's radius of each inner ring


@dataclass(frozen=True)
class Seal:
    """Seal of N cups: ``sealed (N,)`` bool, and the lip's plane by its centre (m) and its normal ``inward``, into the object.

    ``center_m (N, 3)`` and ``inward (N, 3)`` are in the object frame; for a cup that does not seal they are those of
    the undeformed lip. ``advance_m (N,)`` is how much farther than planned the cup moves along its approach to meet the
    surface.
    """

    sealed: np.ndarray
    advance_m: np.ndarray
    center_m: np.ndarray
    inward: np.ndarray


def seal(gripper: SuctionGripper, gripper_to_object: np.ndarray, surface: RayCaster) -> Seal:
    """Project the lips of grasps ``(N, 4, 4)`` onto the surface and return which of them seal."""
    count, rotation = len(gripper_to_object), gripper_to_object[:, :3, :3]
    angle = 2 * np.pi * np.arange(RING_POINTS) / RING_POINTS
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    depth_m, normals = _project(gripper, gripper_to_object, surface, gripper.lip_radius_m * circle)
    hit = np.isfinite(depth_m).all(1)
    ring_m = np.where(hit[:, None], depth_m, 0.0)
    # best-fit plane: mean and first harmonic of the depths around the ring
    middle_m = ring_m.mean(1)
    slope_m = 2 / RING_POINTS * ring_m @ circle
    bent_m = ring_m - middle_m[:, None] - slope_m @ circle.T
    inward = np.column_stack([-slope_m / gripper.lip_radius_m, np.ones(count)])
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    inward = np.einsum("nij,nj->ni", rotation, inward)
    step_m = np.abs(bent_m - np.roll(bent_m, 1, axis=1)).max(1)
    spacing_m = 2 * gripper.lip_radius_m * np.sin(np.pi / RING_POINTS)
    facing = -np.einsum("nki,ni->nk", normals, inward)
    sealed = (
        hit
        & (np.abs(middle_m) <= gripper.reach_m)
        & (np.hypot(*slope_m.T) <= gripper.lip_radius_m * np.tan(gripper.max_tilt_rad))
        & (np.ptp(bent_m, axis=1) <= gripper.lip_travel_m)
        & (step_m <= spacing_m * np.tan(gripper.max_surface_angle_rad))  # a step in depth that no ray's normal reveals
        & (facing.min(1) >= np.cos(gripper.max_surface_angle_rad))
    )
    inner = np.concatenate([gripper.lip_radius_m * share * _spread(number) for number, share in INNER_RINGS])
    inside_m, _ = _project(gripper, gripper_to_object, surface, inner)
    sealed &= (inside_m >= ring_m.min(1)[:, None] - gripper.ceiling_m).all(1)
    sealed &= (inside_m <= ring_m.max(1)[:, None] + gripper.ceiling_m).all(1)
    advance_m = np.where(sealed, middle_m, 0.0)
    center_m = gripper_to_object[:, :3, 3] + (gripper.tip_depth_m + advance_m)[:, None] * rotation[:, :, 2]
    return Seal(sealed, advance_m, center_m, np.where(sealed[:, None], inward, rotation[:, :, 2]))


def _spread(number: int) -> np.ndarray:
    angle = 2 * np.pi * np.arange(number) / number
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _project(
    gripper: SuctionGripper, gripper_to_object: np.ndarray, surface: RayCaster, offsets_m: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Cast rays from points ``offsets_m (K, 2)`` of the lip's plane onto the surface.

    Returns the depth ``(N, K)`` m below the plane (inf if nothing is hit) and the surface normals ``(N, K, 3)``.
    """
    rotation, origin = gripper_to_object[:, :3, :3], gripper_to_object[:, :3, 3]
    behind_m = gripper.reach_m + gripper.ceiling_m  # rays start behind the lip, where a bump may reach
    local = np.column_stack([offsets_m, np.full(len(offsets_m), gripper.tip_depth_m - behind_m)])
    starts = np.einsum("nij,kj->nki", rotation, local) + origin[:, None]
    along = np.repeat(rotation[:, None, :, 2], len(local), axis=1)
    distance_m, face = surface.first_hits(starts.reshape(-1, 3), along.reshape(-1, 3))
    normals = np.where(face[:, None] >= 0, surface.face_normals[face], 0.0)
    return (distance_m - behind_m).reshape(along.shape[:2]), normals.reshape(along.shape)


def lip_load(
    force_n: np.ndarray,
    arm_m: np.ndarray,
    inward: np.ndarray,
    *,
    vacuum_force_n: float,
    friction: float,
    lip_radius_m: float,
) -> np.ndarray:
    """Return the share ``(...)`` of its limits that a lip carries; it detaches beyond 1.

    ``force_n (..., 3)`` acts on the object at ``arm_m (..., 3)`` from the lip's centre; ``inward (..., 3)`` is the unit
    normal of the lip's plane into the object.
    """
    pull = (force_n * inward).sum(-1)
    moment = np.cross(arm_m, force_n)
    twist = (moment * inward).sum(-1)
    shear = np.linalg.norm(force_n - pull[..., None] * inward, axis=-1)
    tilt = np.linalg.norm(moment - twist[..., None] * inward, axis=-1)
    sliding = np.hypot(shear, twist / lip_radius_m) / friction
    peeling = 2 * tilt / lip_radius_m
    return np.asarray((np.maximum(sliding, peeling) + pull) / vacuum_force_n)
