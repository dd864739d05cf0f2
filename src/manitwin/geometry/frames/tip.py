"""Tips: the outermost end of what is long or pointed around a point."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.frames.feature import UP, FeatureFrame, Found, FramedMesh, Unclear, rotation_of
from manitwin.geometry.frames.opening import opening_frame, rim_points

_REACH_SHARES = (0.12, 0.2, 0.35)  # of the longest side: how much of the thing around the point is looked at
_LONG = 1.5  # longest by second spread (variances) of what has a direction
_END_SHARE = 0.012  # of the longest side: what is that near to the outermost place is the end
_FAR_SHARE = 0.25  # of the longest side: an end farther away is not what the point means
_RIVAL = (1.5, 0.02)
"""Times the best score, plus of the longest side: an end that looks elsewhere and is as near as that is a rival."""
_SAME_WAY = np.cos(np.radians(25.0))  # of the directions of two ends that are one
_BLUNT = 0.75  # radius of the end by that of what is behind it within a tenth of the longest side, for short stubs


def tip_frame(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, pours: bool = False) -> Found:
    """Return the end that a surface point is at or near: the outermost place, Z along the tip and out.

    The direction is that of the long part around the point, towards its end; of what ``pours``, a lip that the rim
    is drawn out to (a jug's) is found by its opening. Nothing of the object may lie straight ahead of a tip.
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
        return Unclear("nothing around the point ends in a tip")
    score, best = min(ends, key=lambda end: end[0])
    near = _RIVAL[0] * score + _RIVAL[1] * surface.size_m
    if any(frame.z @ best.z < _SAME_WAY for other, frame in ends if other < near):
        return Unclear("what is around the point ends in several directions")
    return best


def _directions(surface: FramedMesh, point_m: np.ndarray) -> list[tuple[np.ndarray, float]]:
    """Return the directions in which what is around a point is long, both ways, with the share looked at (0: the whole)."""
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
    """Tell whether nothing lies ahead of a tip, and what is behind it is slender.

    ``blunt``: the end of the whole thing's length, which may be as wide as it likes; else what is wide is a side, no tip.
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
    """Return the lip that a rim is drawn out to, where the point is on that side."""
    opening = opening_frame(surface, point_m)
    if isinstance(opening, Unclear) or opening.roll_free or surface.opening is None or opening.z[2] < 0.9:
        return None
    rim = rim_points(surface, surface.opening)
    rim = rim[np.isfinite(rim[:, 0])]
    lip = rim[int(((rim - opening.position_m) @ opening.x).argmax())]
    if np.linalg.norm(lip - point_m) > _FAR_SHARE * surface.size_m:
        return None
    return FeatureFrame("tip", lip, rotation_of(opening.x, opening.z), 0.1 * opening.size_m, False)
