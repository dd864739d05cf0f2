"""An inflated outline that stands on its soles: the feet go down to the ground, and end there in full.

An outline that is inflated ends below in a round edge, on which nothing stands, and of a thing that is seen from a little above
the feet that are farther back end higher in the picture. A cut at the height where all of it is wide enough would take the
feet off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy import ndimage

from manitwin.models.generators.lift.surface import LiftedSurface, cut_below, tip_angle_deg

REACHES = (0.0, 0.03, 0.06, 0.09, 0.12)
"""Shares of the height, tried in turn: what ends so little above the lowest point is a foot too."""
SOLE_SHARE = 0.02
"""The share of the height, at the end of a foot, that is its sole."""
DEEPER = (1.0, 1.5, 2.0, 2.5, 3.0)
"""How much deeper soles may be than their outline tells, tried in turn: a foot is longer than it looks from before it."""
LEAST_SOLE_PX = 2.0


def on_soles(
    mask: np.ndarray, inflated: Callable[[np.ndarray], LiftedSurface], least_angle_deg: float
) -> LiftedSurface | None:
    """Return what ``mask (H, W) bool`` is ``inflated`` to, with its feet on the ground; None where it would tip all the same.

    ``inflated`` makes a body of a mask in its pixels. No part of the outline is cut off.
    """
    rows = np.nonzero(mask.any(axis=1))[0]
    height = int(rows[-1] - rows[0]) + 1
    for reach in REACHES:
        footed = with_soles(mask, reach)
        whole = inflated(footed)
        body = cut_below(_of_picture(whole, footed.shape[0], mask.shape[0]), 1, -float(rows[-1]) - 0.5)
        for deeper in DEEPER:
            standing = _deepened(body, deeper, max(reach, SOLE_SHARE) * height)
            if tip_angle_deg(standing) >= least_angle_deg:
                return standing
    return None


def with_soles(mask: np.ndarray, reach: float) -> np.ndarray:
    """Return ``mask (H, W) bool`` with its feet to its lowest row and on below the picture, ``(H + h, W)``.

    Feet are what lies in the lowest ``reach`` of its height, each with the columns that end in the lowest part of it.
    """
    rows = np.nonzero(mask.any(axis=1))[0]
    lowest, height = int(rows[-1]), int(rows[-1] - rows[0]) + 1
    sole_px = max(LEAST_SOLE_PX, SOLE_SHARE * height)
    band = mask.copy()
    band[: int(np.ceil(lowest + 1 - max(reach * height, sole_px)))] = False
    labels, count = ndimage.label(band, np.ones((3, 3), bool))
    below = np.ceil(height / 4)
    footed = np.pad(mask, ((0, int(below)), (0, 0)))
    for foot in range(1, count + 1):
        own = labels == foot
        columns = np.nonzero(own.any(axis=0))[0]
        ends = own.shape[0] - 1 - own[::-1, columns].argmax(axis=0)
        sole = ends > ends.max() - sole_px
        for column, end in zip(columns[sole], ends[sole], strict=True):
            footed[end:, column] = True
    return footed


def _of_picture(surface: LiftedSurface, made_rows: int, rows: int) -> LiftedSurface:
    """Return a surface whose texture coordinates are those of a picture with ``made_rows`` in the upper ``rows`` of it."""
    uv = surface.uv.copy()
    uv[:, 1] = 1 - (1 - uv[:, 1]) * made_rows / rows
    return replace(surface, uv=uv)


def _deepened(surface: LiftedSurface, deeper: float, reach_px: float) -> LiftedSurface:
    """Return a surface whose lowest ``reach_px`` become, downwards, as many times as deep; no deeper than all of it is."""
    if deeper == 1.0:
        return surface
    y, z = surface.vertices[:, 1], surface.vertices[:, 2]
    down = np.clip(1 - (y - y.min()) / (2 * reach_px), 0, 1)
    most = float(np.abs(z).max() / max(np.abs(z[down > 0]).max(), 1e-9))
    vertices = surface.vertices.copy()
    vertices[:, 2] = z * (1 + (min(deeper, most) - 1) * down)
    return replace(surface, vertices=vertices)
