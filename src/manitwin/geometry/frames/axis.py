"""Frames of handle, shaft and stem axes: a straight line fitted through the slices of an elongated part."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.frames.feature import UP, FeatureFrame, Found, FramedMesh, NoFrame, rotation_of

_STEP_SHARE = 0.025  # fraction of the longest side: distance between slices
_WIDER, _THINNER = 1.7, 0.45  # times the median radius of the slices so far; beyond these another part begins
_SLENDER = 2.2  # least ratio of length to width of a part that has an axis
_BENT_SHARE = 0.1  # fraction of the length: tolerated deviation of slice centres from the line
_LEAST_SAMPLES = 5


def axis_frame(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray) -> Found:
    """Return the axis frame of the elongated part at a surface point: its midpoint, Z along it towards the bulk of the object.

    ``size_m`` is the length. Slices are followed from the point in both directions as long as their radius is similar; their
    centres must lie on a line.
    """
    positions, _ = surface.samples
    deep, _ = surface.caster.first_hits((point_m - 1e-5 * normal)[None], -normal[None])
    matter = float(deep[0]) if np.isfinite(deep[0]) else 0.02 * surface.size_m
    center = point_m - normal * min(matter, 0.3 * surface.size_m) / 2
    best: np.ndarray | None = None
    for share in (0.1, 0.18, 0.3):
        around = surface.near(center, max(share * surface.size_m, 1.3 * matter))
        if len(around) < 3 * _LEAST_SAMPLES:
            continue
        values, vectors = np.linalg.eigh(np.cov((positions[around] - positions[around].mean(0)).T))
        if values[2] < 1.6 * values[1]:
            continue
        slices = _trace_slices(surface, center, vectors[:, 2])
        if best is None or len(slices) > len(best):
            best = slices
    if best is None or len(best) < 3:
        return NoFrame("nothing long is where the point is")
    return _line(surface, best)


def _trace_slices(surface: FramedMesh, center: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the centres and radii of slices ``(S, 4)`` along a part, from one end to the other."""
    first = _slice(surface, center, direction, 0.3 * surface.size_m)
    if first is None:
        return np.zeros((0, 4))
    ahead, behind = (_march(surface, first, sign * direction) for sign in (1.0, -1.0))
    return np.array([*behind[::-1], first, *ahead])


def _march(surface: FramedMesh, first: np.ndarray, direction: np.ndarray) -> list[np.ndarray]:
    step = _STEP_SHARE * surface.size_m
    found = [first]
    while len(found) < 60:
        here = found[-1]
        if len(found) > 3:
            along = here[:3] - found[-4][:3]
            direction = along / np.linalg.norm(along)
        radius = float(np.median([each[3] for each in found]))
        ahead = _slice(surface, here[:3] + step * direction, direction, 2.2 * radius + surface.spacing_m)
        if ahead is None or not _THINNER * radius < ahead[3] < _WIDER * radius:
            break
        if (ahead[:3] - here[:3]) @ direction < 0.3 * step:
            break
        found.append(ahead)
    return found[1:]


def _slice(surface: FramedMesh, center: np.ndarray, direction: np.ndarray, reach_m: float) -> np.ndarray | None:
    """Return the centre and radius of a slice perpendicular to a direction ``(4,)``; None if it has too few samples."""
    positions, _ = surface.samples
    half = max(_STEP_SHARE * surface.size_m, 1.2 * surface.spacing_m) / 2
    around = surface.near(center, float(np.hypot(reach_m, half)))
    offset = positions[around] - center
    inside = offset[np.abs(offset @ direction) < half]
    if len(inside) < _LEAST_SAMPLES:
        return None
    basis = rotation_of(direction)
    flat = inside @ basis[:, :2]
    middle = (flat.min(0) + flat.max(0)) / 2
    radius = float(np.linalg.norm(flat - middle, axis=1).max())
    return np.concatenate([center + basis[:, :2] @ middle, [radius]])


def _line(surface: FramedMesh, slices: np.ndarray) -> Found:
    middles = slices[:, :3]
    mean = middles.mean(0)
    _, _, vectors = np.linalg.svd(middles - mean, full_matrices=False)
    direction = vectors[0]
    along = (middles - mean) @ direction
    length = float(np.ptp(along)) + _STEP_SHARE * surface.size_m
    off = np.linalg.norm(middles - mean - along[:, None] * direction, axis=1)
    width = 2 * float(np.median(slices[:, 3]))
    if length < _SLENDER * width:
        return NoFrame("what is around the point is about as wide as long")
    if off.max() > _BENT_SHARE * length:
        return NoFrame("the part at the point is bent: it has no straight axis")
    middle = mean + direction * (along.min() + along.max()) / 2
    bulk = surface.mesh.bounds.mean(0) + surface.center_of_mass_m - 2 * middle
    z = direction if bulk @ direction > 0 else -direction
    return FeatureFrame("axis", middle, rotation_of(z, UP), length, True)
