"""Frames of holes (bores, rings, handle loops), fitted to the walls that face the hole's axis."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.geometry.frames.feature import FeatureFrame, Found, FramedMesh, NoFrame, rotation_of

_TURNS = 48  # rays around the axis
_CLOSED_SHARE = 0.9  # fraction of the rays that must hit a wall; otherwise it is a notch or a jaw
_ROUNDS = 6
_EVEN = 4.5  # largest ratio of the wall's far to near distances; loops and slots may be oblong
_SLOT = 0.9  # fraction of the largest circle's radius: the clearance that the centre of a slot must have
_LEAST_RADIUS_M = 0.0008
_SEARCH_SHARE, _SEEDS = 0.2, 60  # fraction of the longest side around the point, and number of samples tried there
# penalty per metre along the axis when seeking the narrowest place, as a bore is equally narrow everywhere
_LEVEL = 0.01
_BESIDE_RADII = 1.5
"""Multiple of the radius: points farther from the wall belong to another feature, such as the mouth beside a handle's loop."""
_FEW = 2  # number of starts near the point above which the object's centre is not tried
_ON_WALL = 0.3  # fraction of the radius: a point this close to a hole's wall refers to that hole
_FAN_RAD = np.radians(12)
_FAR = 0.6  # fraction of the longest side: farther walls do not belong to a hole


def hole_frame(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, through: bool = False) -> Found:
    """Return the frame of the hole whose wall or rim a surface point is on; ``size_m`` is the radius of the inscribed circle.

    The frame of a through hole is at its middle with Z towards the end that faces up or +X; that of a blind hole is at its
    mouth with Z outward. X points to the centre of mass. The axis is the direction perpendicular to the normals of the walls
    seen from inside, which is exact for a cylinder and a torus. ``through``: accept only holes that are open at both ends, such
    as a handle's loop but not the mouth beside it.
    """
    best: tuple[float, np.ndarray, np.ndarray, float] | None = None
    for center, axis in _starts(surface, point_m, normal):
        fitted = _fit_hole(surface, center, axis)
        if fitted is None:
            continue
        center, axis, radius = fitted
        beside = float(np.linalg.norm(np.cross(point_m - center, axis)))
        score = abs(beside - radius) / radius
        if through and any(_closed(surface, center, axis, radius)):
            continue
        if score < _BESIDE_RADII and (best is None or score < best[0]):
            best = (score, center, axis, radius)
            if score < _ON_WALL:
                break
    if best is None:
        return NoFrame("no wall around the point closes to a hole")
    return _place_frame(surface, *best[1:])


def _starts(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return initial centres and axes: midpoints to opposite walls, from the point and from samples around it."""
    positions, normals = surface.samples
    starts: list[tuple[np.ndarray, np.ndarray]] = []
    around = surface.near(point_m, _SEARCH_SHARE * surface.size_m)
    around = around[np.argsort(np.linalg.norm(positions[around] - point_m, axis=1), kind="stable")]
    alike = around[: len(around) // 3]
    # the wall of a ring is curved in section too; its mean normal faces the axis
    alike = alike[normals[alike] @ normal > 0.5]
    mean = normals[alike].mean(0) if len(alike) else normal
    spread = around[:: max(1, len(around) // _SEEDS)]
    seeds = np.concatenate([point_m[None], point_m[None], positions[spread]])
    outward = np.concatenate([normal[None], mean[None] / np.linalg.norm(mean), normals[spread]])
    seeds = np.repeat(seeds, 5, axis=0)
    outward = np.concatenate([_fan(each) for each in outward])
    distance, face = surface.caster.first_hits(seeds + 1e-5 * outward, outward)
    for seed, out, far, hit in zip(seeds, outward, distance, face, strict=True):
        if hit < 0 or far > surface.size_m or surface.caster.face_normals[hit] @ out > -0.3:
            continue
        center = seed + out * far / 2
        if any(np.linalg.norm(center - other) < 0.2 * far for other, _ in starts):
            continue
        axis = _open_axis(surface, center, out)
        if axis is not None:
            starts.append((center, axis))
    middle = surface.mesh.bounds.mean(0)  # the narrow round walls of a ring may not face any opposite wall
    _, axes = np.linalg.eigh(np.cov((positions - positions.mean(0)).T))
    return starts if len(starts) > _FEW else starts + [(middle, axis) for axis in axes.T]


def _fan(direction: np.ndarray) -> np.ndarray:
    """Return a direction and four others tilted by 12 degrees: the normal of a ring's facet may miss the opposite wall."""
    basis = rotation_of(direction)
    tilts = np.stack([basis[:, 0], -basis[:, 0], basis[:, 1], -basis[:, 1]])
    return np.concatenate([basis[:, 2][None], np.cos(_FAN_RAD) * basis[:, 2] + np.sin(_FAN_RAD) * tilts])


def _open_axis(surface: FramedMesh, center: np.ndarray, across: np.ndarray) -> np.ndarray | None:
    """Return the direction perpendicular to ``across`` with the longest free view to both sides; None if no side is open."""
    basis = rotation_of(across)
    angle = np.arange(12) * np.pi / 12
    around = np.cos(angle)[:, None] * basis[:, 0] + np.sin(angle)[:, None] * basis[:, 1]
    ahead, _ = surface.caster.first_hits(np.repeat(center[None], 12, 0), around)
    behind, _ = surface.caster.first_hits(np.repeat(center[None], 12, 0), -around)
    open_ends = np.isinf(ahead).astype(int) + np.isinf(behind)
    if not open_ends.any():
        return None
    many = np.flatnonzero(open_ends == open_ends.max())
    span = np.minimum(ahead, surface.size_m) + np.minimum(behind, surface.size_m)
    if len(many) == len(angle):
        return None
    gap = many[int(len(many) / 2)] if np.ptp(many) < 11 else many[int(span[many].argmax())]
    return np.asarray(around[gap])


def _fit_hole(surface: FramedMesh, center: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Return centre, axis and inscribed radius of the hole around a start; None if its walls are not closed."""
    for _ in range(_ROUNDS):
        walls, normals, closed = _throat(surface, center, axis)
        if closed < _CLOSED_SHARE:
            return None
        values, vectors = np.linalg.eigh(normals.T @ normals / len(normals))
        if values[0] > 0.3 * values[1]:
            return None
        turned = vectors[:, 0] * np.sign(vectors[:, 0] @ axis or 1.0)
        if turned @ axis < np.cos(np.radians(50)):
            return None
        axis = turned
        flat = (walls - center) - ((walls - center) @ axis)[:, None] * axis
        shift = _widest(flat, axis) + float(np.median((walls - center) @ axis)) * axis
        center = center + shift
        if np.linalg.norm(shift) < 1e-5:
            break
    walls, _, closed = _throat(surface, center, axis)
    if closed < _CLOSED_SHARE:
        return None
    flat = np.linalg.norm((walls - center) - ((walls - center) @ axis)[:, None] * axis, axis=1)
    radius = float(flat.min())
    if radius < _LEAST_RADIUS_M or np.quantile(flat, 0.9) > _EVEN * np.quantile(flat, 0.1):
        return None
    return center, axis, radius


def _throat(surface: FramedMesh, center: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the narrowest wall positions around the axis, sought up to a third of the radius along it.

    At the narrowest position, the wall of a ring, which is round in section, faces the axis like that of a bore.
    """
    first, _, closed = _walls(surface, center, axis)
    if closed < _CLOSED_SHARE:
        return first, first, closed
    reach = float(np.linalg.norm(first - center, axis=1).min()) / 3
    shifts = reach * np.linspace(-1, 1, 7)
    layers = [_rays(surface, center + shift * axis, axis) for shift in shifts]
    distance = np.stack([np.where(met, far, np.inf) for far, _, met, _ in layers])
    narrowest = (distance + _LEVEL * np.abs(shifts)[:, None]).argmin(0)
    turn = np.flatnonzero(np.isfinite(distance.min(0)))
    faces = np.stack([face for _, face, _, _ in layers])[narrowest[turn], turn]
    places = np.stack([place for _, _, _, place in layers])[narrowest[turn], turn]
    return places, surface.caster.face_normals[faces], len(turn) / _TURNS


def _rays(
    surface: FramedMesh, center: np.ndarray, axis: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return distance, face, whether the face is a wall nearby, and hit position, for each ray around an axis."""
    basis = rotation_of(axis)
    angle = np.arange(_TURNS) * 2 * np.pi / _TURNS
    out = np.cos(angle)[:, None] * basis[:, 0] + np.sin(angle)[:, None] * basis[:, 1]
    distance, face = surface.caster.first_hits(np.repeat(center[None], _TURNS, 0), out)
    facing = np.einsum("ij,ij->i", surface.caster.face_normals[face], out) < 0
    met = (face >= 0) & (distance < _FAR * surface.size_m) & facing
    return distance, face, met, center + out * np.where(met, distance, 0.0)[:, None]


def _walls(surface: FramedMesh, center: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return wall positions, wall normals, and the share of rays around an axis that hit a nearby wall."""
    _, face, met, place = _rays(surface, center, axis)
    return place[met], surface.caster.face_normals[face[met]], float(met.mean())


def _widest(flat: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the step ``(3,)`` from the origin to the centre of the largest circle inside walls ``(N, 3)``.

    For a slot, in which the circle may slide, the step leads to the centre of its minimum-area rectangle.
    """
    basis = rotation_of(axis)
    points = flat @ basis[:, :2]
    best, reach = np.zeros(2), float(np.linalg.norm(points, axis=1).min())
    angle = np.arange(8) * np.pi / 4
    ring = np.concatenate([np.zeros((1, 2)), np.stack([np.cos(angle), np.sin(angle)], axis=1)])
    for _ in range(14):  # coarse to fine
        tried = best + reach * 0.5 * ring
        room = np.linalg.norm(points[None] - tried[:, None], axis=2).min(1)
        best = tried[int(room.argmax())]
        reach *= 0.7
    middle = np.array(cv2.minAreaRect(points.astype(np.float32))[0])
    rooms = [float(np.linalg.norm(points - each, axis=1).min()) for each in (best, middle)]
    return np.asarray(basis[:, :2] @ (middle if rooms[1] > _SLOT * rooms[0] else best))


def _closed(surface: FramedMesh, center: np.ndarray, axis: np.ndarray, radius: float) -> list[bool]:
    """Return whether a hole is closed ahead and behind: most of nine rays along its axis hit something."""
    ring = rotation_of(axis)
    angle = np.arange(8) * np.pi / 4
    spokes = np.cos(angle)[:, None] * ring[:, 0] + np.sin(angle)[:, None] * ring[:, 1]
    from_m = center + 0.4 * radius * np.concatenate([np.zeros((1, 3)), spokes])
    ends = [surface.caster.first_hits(from_m, np.repeat(d[None], 9, 0))[0] for d in (axis, -axis)]
    return [bool(np.mean(np.isfinite(end)) > 0.7) for end in ends]


def _place_frame(surface: FramedMesh, center: np.ndarray, axis: np.ndarray, radius: float) -> Found:
    """Place a hole's frame at its middle, or at its mouth if one end is closed."""
    both = np.stack([axis, -axis])
    closed = _closed(surface, center, axis, radius)
    if all(closed):
        return NoFrame("the hollow at the point has no mouth")
    reach = [_mouth_m(surface, center, d, radius) for d in both]
    if any(closed):
        out = 1 if closed[0] else 0
        position, z = center + both[out] * reach[out], both[out]
    else:
        z = axis if axis @ np.array([0.1, -0.01, 1.0]) > 0 else -axis
        position = center + axis * (reach[0] - reach[1]) / 2
    return FeatureFrame("hole", position, rotation_of(z, surface.center_of_mass_m - position), radius, False)


def _mouth_m(surface: FramedMesh, center: np.ndarray, direction: np.ndarray, radius: float) -> float:
    """Return how far along a direction the walls still enclose the axis, by bisection."""
    low, high = 0.0, surface.size_m
    for _ in range(12):
        middle = (low + high) / 2
        walls, _, closed = _walls(surface, center + middle * direction, direction)
        near = np.linalg.norm(walls - center - middle * direction, axis=1) < 3.0 * radius + 1e-3
        low, high = (middle, high) if closed * near.sum() > 0.6 * len(walls) > 0 else (low, middle)
    return low
