"""Detection of a bail: a handle over an upright body from side to side, as of a kettle, basket or bucket."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_LEAST_RISE = 0.3  # fraction of the body's largest radius: least rise above its top
_BEYOND = 1.1  # times that radius: farther out is a spout
_LEGS = 0.45  # of it: least distance of the legs from the axis, which excludes the loop of a lid
_OVER_AXIS = 0.35  # of it: largest distance of the highest stretch's centre from the axis
_WIDEST = 0.25  # of it: largest half width of the bar; flowers and brushes spread wider
_BETWEEN = 0.3  # of it: region between the legs that must be empty
_FEET = 0.5  # of its rise: depth to which its legs reach down beside a lid
_STRAY = 0.1  # fraction of the samples at the height of its legs
_KNOB = 0.3  # of its rise: height up to which a lid's knob is excluded


@dataclass(frozen=True)
class Bail:
    """A handle over a body.

    It rises ``rise_m`` above the body's top ``low_m``, extends horizontally along ``along (2,)``, lies within ``half_width_m``
    of ``across_m`` from the axis, and within the distance ``radius_m``; its legs reach somewhat below ``low_m``.
    """

    low_m: float
    rise_m: float
    along: np.ndarray
    across_m: float
    half_width_m: float
    radius_m: float

    def contains(self, points_m: np.ndarray, offset_m: np.ndarray, outside_m: np.ndarray) -> np.ndarray:
        """Return which points ``(N, 3)`` belong to it; ``offset_m (N, 2)`` from the axis, ``outside_m (N,)`` beyond the
        outline.
        """
        across = offset_m @ np.array([-self.along[1], self.along[0]]) - self.across_m
        within = (np.abs(across) <= self.half_width_m) & (np.hypot(*offset_m.T) <= self.radius_m)
        rise = (points_m[:, 2] - self.low_m) / self.rise_m
        knob = (np.abs(offset_m @ self.along) < _BETWEEN * self.radius_m) & (rise < _KNOB)
        feet = (outside_m > 0) & (rise > -_FEET)
        return within & (feet | (rise > 0)) & ~knob


def find_bail(surface_m: np.ndarray, axis_xy_m: np.ndarray, top_m: float, radius_m: float) -> Bail | None:
    """Return the handle over a body with top ``top_m`` and radius ``radius_m``; None if there is none."""
    offset = surface_m[:, :2] - axis_xy_m
    above = (surface_m[:, 2] > top_m) & (np.hypot(*offset.T) < _BEYOND * radius_m)
    if above.sum() < 20:
        return None
    offset, height = offset[above], surface_m[above, 2] - top_m
    rise = float(height.max())
    along = np.linalg.eigh(np.cov(offset.T))[1][:, 1]
    place, across = offset @ along, offset @ np.array([-along[1], along[0]])
    middle = float(np.median(across))
    half_width = float(np.quantile(np.abs(across - middle), 0.98))
    apex = offset[height > 0.8 * rise].mean(0)
    legs = (height > _KNOB * rise) & (height < 2 * _KNOB * rise)
    is_one = (
        rise > _LEAST_RISE * radius_m
        and half_width < _WIDEST * radius_m
        and min(place.max(), -place.min()) > _LEGS * radius_m
        and np.hypot(*apex) < _OVER_AXIS * radius_m
        and legs.any()
        and float((np.abs(place[legs]) < _BETWEEN * radius_m).mean()) < _STRAY
    )
    return Bail(top_m, rise, along, middle, 1.3 * half_width, _BEYOND * float(np.abs(place).max())) if is_one else None
