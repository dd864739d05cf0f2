"""Part rules by shape: assign surface points to handle, head, cap, stem or grip.

Each rule takes the measured shape and surface points ``(N, 3)``, and returns the role of each point with a confidence in [0,
1]; None if the shape shows no such border.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from manitwin.geometry.parts.arch import Arch
from manitwin.geometry.parts.membership import Membership, PartRule
from manitwin.geometry.parts.outline import LEAST_EXPLAINED, SLICES, best_splits, explained_confidence, filled_outline
from manitwin.geometry.parts.protrusions import Protrusion
from manitwin.geometry.parts.sections import LEAST_CONTRAST, ended, sectioned
from manitwin.geometry.parts.shape import LEAST_HANDLE_REACH, Shape


def membership(rule: PartRule, shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Return the parts of points ``(N, 3)`` by a rule; None if the shape does not show them, or for surface rules
    (``skin_rules``).
    """
    told = _RULES.get(rule)
    return None if told is None else told(shape, points_m)


_SURE_REACH = 3.0  # times the least reach of a handle: certain protrusion


def _handles(shape: Shape) -> list[Protrusion]:
    first = shape.side_handle
    if first is None:
        return []
    if first.bail is not None:  # protrusions beside a bail are its ears, or a spout
        return [first]
    least_m = LEAST_HANDLE_REACH * float(shape.body.radius_m.max())
    beside = [p for p in shape.body.protrusions if p.reach_m > least_m and p.low_m < shape.body.top_m]
    return [first, *(p for p in beside if p is not first)]


def _handled(shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Body and handle: all protrusions with sufficient reach are handle."""
    found = _handles(shape)
    if not found:
        return None
    mine = np.logical_or.reduce([shape.body.protrusion_mask(points_m, each) for each in found])
    return Membership(("body", "handle"), mine.astype(int), _reach_confidence(shape, found[0]))


def _spouted(shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Body, handle and spout: the protrusion opposite the handle is the spout."""
    found = _handles(shape)
    if not found:
        return None
    index = shape.body.protrusion_mask(points_m, found[0]).astype(int)
    if found[0].bail is not None:
        found = [found[0], *shape.body.protrusions]
    opposite = [p for p in found[1:] if found[0].bail is not None or np.cos(p.azimuth_rad - found[0].azimuth_rad) < 0]
    if opposite:
        index[shape.body.protrusion_mask(points_m, opposite[0])] = 2
    return Membership(("body", "handle", "spout"), index, _reach_confidence(shape, found[0]))


def _reach_confidence(shape: Shape, handle: Protrusion) -> float:
    least_m = LEAST_HANDLE_REACH * float(shape.body.radius_m.max())
    return float(np.clip(0.5 + 0.4 * (handle.reach_m / least_m - 1) / (_SURE_REACH - 1), 0.5, 0.9))


_LEVELS = 72
_SECTORS = 12
_STEP_LEVELS = 2  # levels within which a step occurs
_LEAST_STEP = 0.045  # fraction of the largest radius, beyond what the slopes on both sides explain
_CAP_ABOVE, _CAP_BELOW = 0.35, 0.95  # fraction of the height: range in which a cap may begin
_STEP_BAND = 0.03  # fraction of the longest side: the position of a step is known more precisely than other borders
_CAP_RADIUS = 0.3  # fraction of the largest radius: anything thinner is a wick or pole, not a cap
_PUT_ON = 0.8
"""Fraction of the largest radius: a part that widens above a neck to at most this is a cap, and the neck is not part of it."""
_NECK = 0.35  # fraction of the largest radius: a neck is wider, the stem of a pump is not
_NEXT_STEP, _SURE_STEP = 0.5, 0.12
"""Fractions of the sharpest step and of the radius: a cap begins at the lowest step that large."""


def _outline(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return relative heights ``(K,)`` and radii ``(K,)`` m of the outline about the body's axis, averaged over directions."""
    low, high = shape.bounds_m[:, 2]
    share = (shape.surface_m[:, 2] - low) / max(high - low, 1e-9)
    radius = np.hypot(*(shape.surface_m[:, :2] - shape.body.axis_xy_m).T)
    level = np.clip((share * _LEVELS).astype(int), 0, _LEVELS - 1)
    sector = ((shape.body.azimuth(shape.surface_m) + np.pi) / (2 * np.pi) * _SECTORS).astype(int) % _SECTORS
    outermost = np.full((_LEVELS, _SECTORS), np.nan)
    np.fmax.at(outermost, (level, sector), radius)
    seen = np.isfinite(outermost).sum(1) >= _SECTORS / 2
    found = np.full(_LEVELS, np.nan)
    found[seen] = np.nanmean(outermost[seen], axis=1)
    heights = (np.arange(_LEVELS) + 0.5) / _LEVELS
    known = np.isfinite(found)
    return heights, np.interp(heights, heights[known], found[known])


def _steps(radius: np.ndarray) -> np.ndarray:
    """Return the upward step of the outline at each level (m), minus what the adjacent slopes explain."""
    steps = np.zeros(len(radius))
    d = _STEP_LEVELS
    for k in range(2 * d, len(radius) - 2 * d):
        rise = radius[k + d - 1] - radius[k - d]
        below, above = radius[k - d] - radius[k - 2 * d], radius[k + 2 * d - 1] - radius[k + d - 1]
        below, above = np.sign(rise) * below, np.sign(rise) * above
        slope = max(
            above, below if above > 0 else 0.0, 0.0
        )  # a slope that continues above is a shoulder; a cap's side is vertical
        steps[k] = np.sign(rise) * max(abs(rise) - slope * (2 * d - 1) / d, 0.0)
    return steps


def _capped(shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Body and cap: the outline has a step where the cap begins, outward above a neck or inward from a shoulder."""
    heights, radius = _outline(shape)
    steps = _steps(radius) / max(float(radius.max()), 1e-9)
    steps[(heights < _CAP_ABOVE) | (heights > _CAP_BELOW)] = 0.0
    weight = np.where(steps > 0, 1.5 * steps, -steps)  # an outward step marks a cap put on
    above = np.array([float(radius[k : k + 2 * _STEP_LEVELS].max()) for k in range(_LEVELS)])
    weight[above < _CAP_RADIUS * radius.max()] = 0.0
    enough = np.flatnonzero(weight >= np.clip(_NEXT_STEP * weight.max(), _LEAST_STEP, _SURE_STEP))
    if not len(enough):
        return None
    neck = np.array([float(radius[max(k - 2 * _STEP_LEVELS, 0) : k].min()) for k in enough]) > _NECK * radius.max()
    put_on = enough[(steps[enough] > 0) & (above[enough] < _PUT_ON * radius.max()) & neck]
    first = int((put_on if len(put_on) else enough)[0])
    best = first + int(weight[first : first + 2 * _STEP_LEVELS].argmax())
    border = best / _LEVELS
    low, high = shape.bounds_m[:, 2]
    share = (points_m[:, 2] - low) / max(high - low, 1e-9)
    confidence = float(np.clip(0.5 + 2.0 * (weight[best] - _LEAST_STEP), 0.5, 0.9))
    return Membership(("body", "cap"), (share > border).astype(int), confidence, _STEP_BAND)


_STEM_SHARE = 0.45  # fraction of the radii of foot and bowl: largest radius of a stem


def _stemmed(shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Bowl, stem and foot: the stem is the narrow section between two wide ones."""
    heights, radius = _outline(shape)
    middle = (heights > 0.08) & (heights < 0.85)
    narrow = int(np.where(middle, radius, np.inf).argmin())
    foot, bowl = float(radius[:narrow].max(initial=0.0)), float(radius[narrow:].max())
    if radius[narrow] > _STEM_SHARE * min(foot, bowl):
        return None
    lower = radius[: narrow + 1] > np.sqrt(radius[narrow] * foot)
    upper = radius[narrow:] > np.sqrt(radius[narrow] * bowl)
    first = (int(np.flatnonzero(lower).max()) + 1) / _LEVELS if lower.any() else 0.0
    last = (narrow + int(np.flatnonzero(upper).min())) / _LEVELS
    low, high = shape.bounds_m[:, 2]
    share = (points_m[:, 2] - low) / max(high - low, 1e-9)
    return Membership(("bowl", "stem", "foot"), np.where(share > last, 0, np.where(share < first, 2, 1)), 0.8)


def _pistol(shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Housing and grip: everything below the barrel is grip."""
    if shape.pistol is None:
        return None
    _, down = shape.pistol.places(points_m)
    return Membership(("housing", "grip"), (down > 1.0).astype(int), 0.75)


_ARCH_TOP = 0.5  # fraction of the way from the centre to the apex: above it the legs of an arch meet


def _arched(shape: Shape, points_m: np.ndarray) -> Membership | None:
    """Band and ear cups: the legs of an arch widen at their ends, found as a single change point of width and thickness."""
    if shape.arch is None:
        return None
    outline = _leg_outline(shape.arch, shape.surface_m, shape.size_m)
    explained, (split,) = best_splits(outline, 1)
    wider = float((outline[:split].mean(0) - outline[split:].mean(0)).mean())
    if explained < LEAST_EXPLAINED or wider < np.log(LEAST_CONTRAST):
        return None
    border = -1 + (1 + _ARCH_TOP) * split / SLICES
    towards, _ = shape.arch.places(points_m)
    return Membership(("band", "cup"), (towards < border).astype(int), explained_confidence(explained))


def _leg_outline(arch: Arch, surface_m: np.ndarray, size_m: float) -> np.ndarray:
    """Return the logarithms of width and thickness ``(48, 2)`` of an arch's legs, from their ends upward."""
    towards, across = arch.places(surface_m)
    width = (surface_m - arch.origin_m) @ np.cross(arch.apex, arch.apart)
    level = np.floor((towards + 1) / (1 + _ARCH_TOP) * SLICES).astype(int)
    leg = np.stack([width, np.abs(across) * arch.half_m[1]], axis=1)
    return filled_outline([leg[level == k] for k in range(SLICES)], 1e-3 * size_m)


_RULES: dict[PartRule, Callable[[Shape, np.ndarray], Membership | None]] = {
    "handled": _handled,
    "spouted": _spouted,
    "capped": _capped,
    "stemmed": _stemmed,
    "ended": ended,
    "sectioned": sectioned,
    "pistol": _pistol,
    "arched": _arched,
}
