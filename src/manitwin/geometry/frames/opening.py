"""Frames of openings: rim plane, rim centre and pour direction."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.cavity import Opening
from manitwin.geometry.frames.feature import FeatureFrame, Found, FramedMesh, NoFrame, rotation_of

_TURNS = 72
_LAYERS = 16
# fraction of the rim's radius, one-sided; the lip of a jug exceeds it, the rim of a scanned mug does not
_SPOUT_BULGE = 0.08
_HANDLE_SECTOR_RAD = np.radians(50)  # rim sector excluded around a handle, as a pan's handle resembles a spout
_OBLONG = 1.15  # aspect ratio of a rim from which its roll is determined
_MOST_TILT_RAD = np.radians(20)  # tilt of the rim's plane against the direction in which the cavity was found
_NEAR_RADII = 1.6  # a point beyond this many rim radii from the centre belongs to another feature
_BESIDE, _JUMP = 4, 1.3
"""Neighbours among 72 azimuths: a wall this many times farther away than theirs is a handle behind a low rim."""


def opening_frame(surface: FramedMesh, point_m: np.ndarray) -> Found:
    """Return the frame of the opening at a point: rim plane and centre, with X in the pour direction.

    X points to a spout (a one-sided bulge of the rim of more than 8 %, or a protrusion opposite the handle), else away from the
    handle, else along an oblong rim. The roll of a round rim with none of these is free.
    """
    opening = surface.opening
    if opening is None:
        return NoFrame("nothing here would hold water")
    offset = point_m - opening.center_m
    above = float(offset @ opening.axis)
    radial = float(np.linalg.norm(offset - above * opening.axis))
    if radial > _NEAR_RADII * opening.rim_radius_m + 0.01 or above < -1.2 * opening.depth_m - 0.01:
        return NoFrame("the point is not at the opening")
    rim = rim_points(surface, opening)
    met = np.isfinite(rim[:, 0])
    if met.mean() < 0.6:
        return NoFrame("the rim of the opening is not closed")
    axis, center = _plane(rim[met], opening)
    x, free = _pour_direction(surface, opening, rim, axis, center)
    return FeatureFrame("opening", center, rotation_of(axis, x), opening.rim_radius_m, free)


def rim_points(surface: FramedMesh, opening: Opening) -> np.ndarray:
    """Return the top of the inner wall at 72 azimuths about the opening's axis, ``(72, 3)`` m; NaN where none is found.

    Horizontal rays from the axis are cast at increasing heights around the brim; the last one that hits a wall is just below
    its top.
    """
    basis = rotation_of(opening.axis)
    angle = np.arange(_TURNS) * 2 * np.pi / _TURNS
    out = np.cos(angle)[:, None] * basis[:, 0] + np.sin(angle)[:, None] * basis[:, 1]
    low, high = -0.5 * opening.depth_m, max(0.5 * opening.depth_m, 0.3 * opening.rim_radius_m)
    heights = np.linspace(low, high, _LAYERS)
    met = np.zeros((_LAYERS, _TURNS), dtype=bool)
    for layer, height in enumerate(heights):
        met[layer], _ = _meets(surface, opening, out, np.full(_TURNS, height))
    run = np.cumprod(met, axis=0).sum(0)  # the wall is the unbroken run from below, which excludes a bail above it
    found = (run > 0) & (run < _LAYERS)
    below = heights[np.clip(run - 1, 0, _LAYERS - 1)]
    over = heights[np.clip(run, 0, _LAYERS - 1)]
    for _ in range(8):
        middle = (below + over) / 2
        hit, _ = _meets(surface, opening, out, middle)
        below, over = np.where(hit, middle, below), np.where(hit, over, middle)
    _, distance = _meets(surface, opening, out, below)
    around = np.stack([np.roll(distance, turn) for turn in range(-_BESIDE, _BESIDE + 1)])
    found &= np.isfinite(distance) & (distance < _JUMP * np.median(around, axis=0))
    rim = opening.center_m + below[:, None] * opening.axis + np.where(found, distance, 0.0)[:, None] * out
    rim[~found] = np.nan
    return np.asarray(rim)


def _meets(
    surface: FramedMesh, opening: Opening, out: np.ndarray, heights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    origins = opening.center_m + heights[:, None] * opening.axis
    distance, face = surface.caster.first_hits(origins, out)
    facing = np.einsum("ij,ij->i", surface.caster.face_normals[face], out) < 0
    met = (face >= 0) & facing & (distance < 2.2 * opening.rim_radius_m)
    return met, np.where(met, distance, np.inf)


def _plane(rim: np.ndarray, opening: Opening) -> tuple[np.ndarray, np.ndarray]:
    """Fit the rim's plane, returned as normal and centre; spouts and notches are excluded by two rounds of trimming."""
    kept = rim
    for _ in range(3):
        middle = kept.mean(0)
        _, _, vectors = np.linalg.svd(kept - middle, full_matrices=False)
        normal = vectors[2] * (1 if vectors[2] @ opening.axis > 0 else -1)
        off = np.abs((rim - middle) @ normal)
        kept = rim[off <= max(2.5 * float(np.median(off)), 1e-4)]
    if normal @ opening.axis < np.cos(_MOST_TILT_RAD):
        normal = opening.axis
    height = float(np.median((rim - opening.center_m) @ normal))
    basis = rotation_of(normal)
    flat = (rim - opening.center_m) @ basis[:, :2]
    turns = np.linspace(0, np.pi, 36, endpoint=False)
    spans = flat @ np.stack([np.cos(turns), np.sin(turns)])
    halves = (spans.max(0) + spans.min(0)) / 2  # centre between both ends in every direction, by least squares
    middle = 2 / 36 * np.array([halves @ np.cos(turns), halves @ np.sin(turns)])
    return normal, opening.center_m + basis[:, :2] @ middle + height * normal


def _pour_direction(
    surface: FramedMesh, opening: Opening, rim: np.ndarray, axis: np.ndarray, center: np.ndarray
) -> tuple[np.ndarray, bool]:
    basis = rotation_of(axis)
    met = np.isfinite(rim[:, 0])
    flat = np.where(met[:, None], (rim - center) @ basis[:, :2], np.nan)
    radius = np.hypot(*flat.T)
    radius = np.where(np.isfinite(radius), radius, np.nanmedian(radius))
    azimuth = np.arange(_TURNS) * 2 * np.pi / _TURNS
    outer = _handle_and_spout_azimuths(surface, basis, center, opening)
    handle, spout = outer
    one_sided = _odd_part(radius / np.median(radius) - 1)
    if handle is not None:
        one_sided = np.where(_turn(azimuth, handle) < _HANDLE_SECTOR_RAD, -1.0, one_sided)
    if one_sided.max() > _SPOUT_BULGE:
        at: float | None = float(azimuth[int(one_sided.argmax())])
    elif spout is not None:
        at = spout
    else:
        at = None if handle is None else handle + np.pi
    if at is not None:
        return np.asarray(np.cos(at) * basis[:, 0] + np.sin(at) * basis[:, 1]), False
    width = np.array([np.ptp(np.nan_to_num(flat, nan=0.0) @ [np.cos(a), np.sin(a)]) for a in azimuth[: _TURNS // 2]])
    if width.max() > _OBLONG * width.min():
        at = float(azimuth[int(width.argmax())])
        return np.asarray(np.cos(at) * basis[:, 0] + np.sin(at) * basis[:, 1]), False
    return np.array([1.0, 0.0, 0.0]), True


def _odd_part(profile: np.ndarray) -> np.ndarray:
    """Return the one-sided part of a circular profile: its odd harmonics, which are zero for an ellipse or square."""
    smooth = (np.roll(profile, 1) + profile + np.roll(profile, -1)) / 3
    spectrum = np.fft.rfft(smooth)
    spectrum[0] = 0
    spectrum[2::2] = 0
    return np.fft.irfft(spectrum, len(profile))


def _turn(a: np.ndarray, b: float) -> np.ndarray:
    return np.abs((a - b + np.pi) % (2 * np.pi) - np.pi)


def _handle_and_spout_azimuths(
    surface: FramedMesh, basis: np.ndarray, center: np.ndarray, opening: Opening
) -> tuple[float | None, float | None]:
    """Return the azimuths (rad) of a single handle and of a spout beside the body; None if absent.

    Two similar protrusions opposite each other are both handles. A handle returns to the body lower down while a spout ends in
    a tip, so the taller of the two is the handle.
    """
    body = surface.body(center[:2]) if basis[2, 2] > 0.9 else None
    if body is None:
        return None, None
    large = [p for p in body.protrusions if p.reach_m > 0.15 * opening.rim_radius_m]
    if not large:
        return None, None
    by_height = sorted(large, key=lambda p: -p.height_m)
    handle, others = by_height[0], by_height[1:]
    opposite = [p for p in others if _turn(np.array(p.azimuth_rad), handle.azimuth_rad + np.pi) < np.radians(30)]
    towards = [_in_plane(p.azimuth_rad, basis) for p in (handle, *opposite[:1])]
    if not opposite:
        return towards[0], None
    alike = opposite[0].height_m > 0.7 * handle.height_m and opposite[0].reach_m > 0.7 * handle.reach_m
    if alike:
        return None, towards[0] + np.pi / 2
    return towards[0], towards[1]


def _in_plane(azimuth_rad: float, basis: np.ndarray) -> float:
    """Return the angle within the rim's plane of a horizontal azimuth."""
    direction = np.array([np.cos(azimuth_rad), np.sin(azimuth_rad), 0.0])
    return float(np.arctan2(direction @ basis[:, 1], direction @ basis[:, 0]))
