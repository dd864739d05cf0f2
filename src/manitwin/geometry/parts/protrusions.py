"""Protrusions of an upright round body (handles and spouts), and a bail over it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from manitwin.geometry.parts.bail import Bail, find_bail

_HEIGHTS = 24
_DIRECTIONS = 36
_OUT_BY = 1.12  # times the body's radius at that height
_OUT_BY_SHARE = 0.03  # plus this share of the body's largest radius, to ignore relief and seams
_BODY_DIRECTIONS = 0.6  # a slice with fewer occupied directions does not belong to the body
_WIDEST_PROTRUSION = 0.4  # of all directions: anything wider is the body's own shape


@dataclass(frozen=True)
class Protrusion:
    """A part that sticks out of the body in one direction.

    ``azimuth_rad`` is its direction about the vertical through ``axis_xy_m``; ``reach_m`` its extent beyond the body; ``share``
    its share of the surface samples; ``height_m`` the height of its outer half; ``low_m`` its lowest point. ``bail`` is set for
    a handle over the body; ``reach_m`` is then its rise above the body.
    """

    azimuth_rad: float
    half_width_rad: float
    reach_m: float
    share: float
    height_m: float
    low_m: float
    bail: Bail | None = None


@dataclass(frozen=True)
class RoundBody:
    """A body about a vertical axis and its protrusions, largest first.

    ``heights_m (24,)`` and ``radius_m (24,)`` are the body's outline. ``top_m`` is the end of the longest run of heights with a
    closed outline; the contents of a vase are above it. ``over`` is the bail over the body, which is not among ``protrusions``.
    """

    axis_xy_m: np.ndarray
    heights_m: np.ndarray
    radius_m: np.ndarray
    top_m: float
    protrusions: tuple[Protrusion, ...]
    over: Protrusion | None = None

    def radius_at(self, points_m: np.ndarray) -> np.ndarray:
        """Return the body's radius (m) at the heights of points ``(N, 3)``."""
        return np.interp(points_m[:, 2], self.heights_m, self.radius_m)

    def outside_m(self, points_m: np.ndarray) -> np.ndarray:
        """Return the distance (m) of points ``(N, 3)`` beyond the body's outline; negative inside."""
        return np.hypot(*(points_m[:, :2] - self.axis_xy_m).T) - self._limit(points_m)

    def azimuth(self, points_m: np.ndarray) -> np.ndarray:
        """Return the azimuth (rad) of points ``(N, 3)`` about the axis."""
        offset = points_m[:, :2] - self.axis_xy_m
        return np.arctan2(offset[:, 1], offset[:, 0])

    def protrusion_mask(self, points_m: np.ndarray, protrusion: Protrusion) -> np.ndarray:
        """Return which points ``(N, 3)`` belong to a protrusion."""
        if protrusion.bail is not None:
            return protrusion.bail.contains(points_m, points_m[:, :2] - self.axis_xy_m, self.outside_m(points_m))
        turn = np.abs((self.azimuth(points_m) - protrusion.azimuth_rad + np.pi) % (2 * np.pi) - np.pi)
        beside = (self.outside_m(points_m) > 0) & (turn <= protrusion.half_width_rad)
        return beside if self.over is None else beside & ~self.protrusion_mask(points_m, self.over)

    def _limit(self, points_m: np.ndarray) -> np.ndarray:
        return _OUT_BY * self.radius_at(points_m) + _OUT_BY_SHARE * self.radius_m.max()


def round_body(surface_m: np.ndarray, axis_xy_m: np.ndarray | None = None) -> RoundBody:
    """Measure the outline of a body about the vertical from surface samples ``(N, 3)``, and its protrusions.

    At each height the radius is the median, over directions, of the outermost sample: a handle occupies few directions. If not
    given, the axis is fitted (Kasa's circle fit, trimmed).
    """
    axis_xy_m = _fitted_axis(surface_m[:, :2]) if axis_xy_m is None else np.asarray(axis_xy_m, dtype=float)
    offset = surface_m[:, :2] - axis_xy_m
    radius = np.hypot(offset[:, 0], offset[:, 1])
    direction = ((np.arctan2(offset[:, 1], offset[:, 0]) + np.pi) / (2 * np.pi) * _DIRECTIONS).astype(int) % _DIRECTIONS
    low, high = surface_m[:, 2].min(), surface_m[:, 2].max()
    level = np.clip(((surface_m[:, 2] - low) / max(high - low, 1e-9) * _HEIGHTS).astype(int), 0, _HEIGHTS - 1)
    outermost = np.zeros((_HEIGHTS, _DIRECTIONS))
    np.maximum.at(outermost, (level, direction), radius)
    occupied = (outermost > 0).sum(1) >= _BODY_DIRECTIONS * _DIRECTIONS
    heights = low + (np.arange(_HEIGHTS) + 0.5) * (high - low) / _HEIGHTS
    if not occupied.any():
        return RoundBody(axis_xy_m, heights, np.full(_HEIGHTS, float(np.median(radius))), float(high), ())
    outline = np.array([np.median(row[row > 0]) if row.any() else np.nan for row in outermost])
    outline = np.interp(heights, heights[occupied], outline[occupied])
    body = RoundBody(axis_xy_m, heights, outline, float(heights[_longest_run(occupied)[-1]]), ())
    body = replace(body, over=_over(body, surface_m))
    beside = surface_m if body.over is None else surface_m[~body.protrusion_mask(surface_m, body.over)]
    return replace(body, protrusions=_protrusions(body, beside))


def _over(body: RoundBody, surface_m: np.ndarray) -> Protrusion | None:
    """Return the bail over a body, if any."""
    top_m = body.top_m + 0.5 * float(body.heights_m[1] - body.heights_m[0])
    bail = find_bail(surface_m, body.axis_xy_m, top_m, float(body.radius_m.max()))
    if bail is None:
        return None
    found = Protrusion(0.0, np.pi, bail.rise_m, 0.0, bail.rise_m, bail.low_m, bail)
    return replace(found, share=float(body.protrusion_mask(surface_m, found).mean()))


def _longest_run(flags: np.ndarray) -> np.ndarray:
    """Return the indices of the longest run of true flags, the first of equal ones; there is at least one."""
    places = np.flatnonzero(flags)
    return max(np.split(places, np.flatnonzero(np.diff(places) > 1) + 1), key=len)


def _fitted_axis(points_xy_m: np.ndarray) -> np.ndarray:
    kept = points_xy_m
    center = kept.mean(0)
    for _ in range(8):
        system = np.column_stack([kept, np.ones(len(kept))])
        solution, *_ = np.linalg.lstsq(system, (kept**2).sum(1), rcond=None)
        center = solution[:2] / 2
        distance = np.linalg.norm(points_xy_m - center, axis=1)
        typical = float(np.median(distance))
        kept = points_xy_m[distance < 1.3 * typical + 1e-9]
    return center


def _protrusions(body: RoundBody, surface_m: np.ndarray) -> tuple[Protrusion, ...]:
    outside = body.outside_m(surface_m)
    out = outside > 0
    if not out.any():
        return ()
    azimuth = body.azimuth(surface_m[out])
    sector = ((azimuth + np.pi) / (2 * np.pi) * _DIRECTIONS).astype(int) % _DIRECTIONS
    counts = np.bincount(sector, minlength=_DIRECTIONS)
    found = []
    for run in _circular_runs(counts > 0):
        if len(run) > _WIDEST_PROTRUSION * _DIRECTIONS:
            continue
        members = np.isin(sector, run % _DIRECTIONS)
        reach = float(outside[out][members].max())
        outer = surface_m[out][members & (outside[out] >= 0.5 * reach), 2]
        middle = run[0] + (len(run) - 1) / 2
        found.append(
            Protrusion(
                azimuth_rad=float((middle + 0.5) / _DIRECTIONS * 2 * np.pi - np.pi),
                half_width_rad=(len(run) / 2 + 0.5) / _DIRECTIONS * 2 * np.pi,
                reach_m=reach,
                share=float(counts[run % _DIRECTIONS].sum() / len(surface_m)),
                height_m=float(np.ptp(outer)),
                low_m=float(surface_m[out][members, 2].min()),
            )
        )
    return tuple(sorted(found, key=lambda p: -p.reach_m * p.share))


def _circular_runs(flags: np.ndarray) -> list[np.ndarray]:
    """Return the runs of true flags around a circle, as increasing indices that may exceed its length."""
    count = len(flags)
    if flags.all():
        return [np.arange(count)]
    start = int(np.flatnonzero(~flags)[0])
    runs: list[list[int]] = []
    for step in range(count):
        index = start + step
        if flags[index % count]:
            if flags[(index - 1) % count] and runs:
                runs[-1].append(index)
            else:
                runs.append([index])
    return [np.array(run) for run in runs]
