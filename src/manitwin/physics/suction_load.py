"""What a sealed lip must carry, as a share of what it can: pull, shear with twist, and tilt.

The lip presses on the surface with N = V - T: the vacuum's force V less the pull T along its axis. It holds where

* friction carries shear and twist: hypot(S, M_n / r) <= mu N, the limit surface of Howe and Cutkosky (1996) as an ellipsoid,
  whose twist mu N r is exact for a thin ring;
* the lip stays pressed on all around: M_t <= N r / 2, where the pressure of a thin elastic ring, N / (2 pi r) (1 + a cos)
  with M_t = a N r / 2, becomes zero at one edge.

The first is that of Dex-Net 3.0 (Mahler et al., ICRA 2018, section IV-B) without its linearisation; in place of its
elastic moment limit, a constant of the cup's material, stands the second. Both are linear in the load: each is carried
where ``(S / mu + T) / V <= 1`` and ``(2 M_t / r + T) / V <= 1``.
"""

from __future__ import annotations

import numpy as np


def lip_load(
    force_n: np.ndarray,
    arm_m: np.ndarray,
    inward: np.ndarray,
    *,
    vacuum_force_n: float,
    friction: float,
    lip_radius_m: float,
) -> np.ndarray:
    """Return the share ``(...)`` of its limits that a lip carries; it lets go beyond 1.

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
