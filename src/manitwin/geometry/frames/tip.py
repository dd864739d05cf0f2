"""Frames of tips: the outermost end of an elongated or pointed part."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.frames.feature import UP, FeatureFrame, Found, FramedMesh, NoFrame, rotation_of
from manitwin.geometry.frames.opening import opening_frame, rim_points

# Fractions of the longest side: neighbourhoods of the point in which an elongated direction is sought
_REACH_SHARES = (0.12, 0.2, 0.35)
_LONG = 1.5  # least ratio of the largest to the second variance of an elongated neighbourhood
_END_SHARE = 0.012  # fraction of the longest side: points this close to the outermost one form the end
_FAR_SHARE = 0.25  # fraction of the longest side: farther ends are not the one at the point
_RIVAL = (1.5, 0.02)
"""An end in another direction with a score below this multiple of the best, plus a share of the longest side, is a rival."""
_SAME_WAY = np.cos(np.radians(25.0))  # directions of two ends that count as one
_BLUNT = 0.75  # least share of nearby samples in the cone behind the end


def tip_frame(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, pours: bool = False) -> Found:
    """Return the frame of the tip at or near a surface point: the outermost point, Z along the tip and outward.

    The direction is that of the elongated part around the point, towards its end. With ``pours``, the lip of a rim (as of a
    jug) is found from the opening. No part of the object may lie straight ahead of a tip.
    """
    lip = _lip(surface, point_m) if pours else None
    if lip is not None:
        return lip
    ends = []
    for direction, share in _directions(surface, point_m):
        frame = _end(surface, point_m, direction, share)
        if frame is not None:
            away = float(np.linalg.norm(frame.position_m - point_m))
            beyond = float((surface.mesh.vertices @ frame.z).max() - frame.position_m @ frame.z)
            ends.append((away + 0.5 * beyond, frame))
    if not ends:
        return NoFrame("nothing around the point ends in a tip")
    score, best = min(ends, key=lambda end: end[0])
    near = _RIVAL[0] * score + _RIVAL[1] * surface.size_m
    if any(frame.z @ best.z < _SAME_WAY for other, frame in ends if other < near):
        return NoFrame("what is around the point ends in several directions")
    return best


def _directions(surface: FramedMesh, point_m: np.ndarray) -> list[tuple[np.ndarray, float]]:
    """Return the directions, with both signs, in which neighbourhoods of a point are elongated, with their share (0: whole
    object).
    """
    positions, _ = surface.samples
    found = []
    for share in (*_REACH_SHARES, 0.0):
        around = surface.near(point_m, share * surface.size_m) if share else np.arange(len(positions))
        if len(around) < 12:
            continue
        values, vectors = np.linalg.eigh(np.cov((positions[around] - positions[around].mean(0)).T))
        if values[2] > _LONG * values[1]:
            found += [(vectors[:, 2], share), (-vectors[:, 2], share)]
    return found


def _end(surface: FramedMesh, point_m: np.ndarray, direction: np.ndarray, share: float) -> FeatureFrame | None:
    positions, _ = surface.samples
    vertices = surface.mesh.vertices
    reach = max(share, 0.12) * surface.size_m
    local = vertices[np.linalg.norm(vertices - point_m, axis=1) < reach]
    local = np.concatenate([local, positions[surface.near(point_m, reach)]])
    for _ in range(3):
        top = float((local @ direction).max())
        thick = max(_END_SHARE * surface.size_m, 0.5 * surface.spacing_m)
        end = local[local @ direction > top - thick]
        tip = (end.min(0) + end.max(0)) / 2
        tip = tip + direction * (top - tip @ direction)
        behind = positions[surface.near(tip, 0.2 * surface.size_m)]
        if len(behind) < 12:
            break
        values, vectors = np.linalg.eigh(np.cov((behind - behind.mean(0)).T))
        if values[2] < _LONG * values[1] or abs(vectors[:, 2] @ direction) < np.cos(np.radians(35)):
            break
        direction = vectors[:, 2] * np.sign(vectors[:, 2] @ direction)
    if np.linalg.norm(tip - point_m) > _FAR_SHARE * surface.size_m:
        return None
    if not _is_end(surface, tip, direction, blunt=share == 0):
        return None
    across = end - tip - ((end - tip) @ direction)[:, None] * direction
    radius = max(float(np.linalg.norm(across, axis=1).max()), 0.002 * surface.size_m)
    return FeatureFrame("tip", tip, rotation_of(direction, UP), radius, True)


def _is_end(surface: FramedMesh, tip: np.ndarray, direction: np.ndarray, blunt: bool) -> bool:
    """Return whether nothing lies ahead of a tip, and the part behind it is slender.

    ``blunt``: the end of the whole object, which may have any width; otherwise a wide end is a side, not a tip.
    """
    positions, _ = surface.samples
    offset = positions[surface.near(tip, 0.15 * surface.size_m)] - tip
    ahead = offset @ direction
    across = np.linalg.norm(offset - ahead[:, None] * direction, axis=1)
    if np.mean((ahead > 0.02 * surface.size_m) & (across < ahead + 0.02 * surface.size_m)) > 0.02:
        return False
    behind = (ahead < 0) & (across < -ahead + 0.06 * surface.size_m)
    return blunt or bool(behind.mean() > _BLUNT)


def _lip(surface: FramedMesh, point_m: np.ndarray) -> FeatureFrame | None:
    """Return the frame of the lip of a rim if the point is on its side; otherwise None."""
    opening = opening_frame(surface, point_m)
    if isinstance(opening, NoFrame) or opening.roll_free or surface.opening is None or opening.z[2] < 0.9:
        return None
    rim = rim_points(surface, surface.opening)
    rim = rim[np.isfinite(rim[:, 0])]
    lip = rim[int(((rim - opening.position_m) @ opening.x).argmax())]
    if np.linalg.norm(lip - point_m) > _FAR_SHARE * surface.size_m:
        return None
    return FeatureFrame("tip", lip, rotation_of(opening.x, opening.z), 0.1 * opening.size_m, False)
