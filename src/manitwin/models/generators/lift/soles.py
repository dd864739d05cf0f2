"""Standing pose of an inflated silhouette on its feet: the feet are extended to the ground and end there in flat soles.

An inflated silhouette has a round lower edge, on which nothing stands. In a view from slightly above, feet farther back end
higher in the picture. A cut at the height where the body is wide enough would remove the feet.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy import ndimage

from manitwin.models.generators.lift.surface import LiftedSurface, cut_below, tip_angle_deg

FOOT_HEIGHT_SHARES = (0.0, 0.03, 0.06, 0.09, 0.12)
"""Heights above the lowest point, as shares of the total height, up to which a part counts as a foot; tried in turn."""
SOLE_SHARE = 0.02
"""Height of a sole at the end of a foot, as a share of the total height."""
SOLE_DEPTH_FACTORS = (1.0, 1.5, 2.0, 2.5, 3.0)
"""Factors on the depth of the soles, tried in turn: a foot is longer than it looks from the front."""
LEAST_SOLE_PX = 2.0


def inflate_on_soles(
    mask: np.ndarray, inflated: Callable[[np.ndarray], LiftedSurface], least_angle_deg: float
) -> LiftedSurface | None:
    """Return the inflation of ``mask (H, W) bool`` with its feet on the ground; None if it would still tip over.

    ``inflated`` makes a body of a mask in its pixels. No part of the silhouette is cut off.
    """
    rows = np.nonzero(mask.any(axis=1))[0]
    height = int(rows[-1] - rows[0]) + 1
    for reach in FOOT_HEIGHT_SHARES:
        footed = extend_feet(mask, reach)
        whole = inflated(footed)
        body = cut_below(_convert_uv(whole, footed.shape[0], mask.shape[0]), 1, -float(rows[-1]) - 0.5)
        for deeper in SOLE_DEPTH_FACTORS:
            standing = _deepen_feet(body, deeper, max(reach, SOLE_SHARE) * height)
            if tip_angle_deg(standing) >= least_angle_deg:
                return standing
    return None


def extend_feet(mask: np.ndarray, reach: float) -> np.ndarray:
    """Return ``mask (H, W) bool`` with its feet extended to the lowest row and below the picture, ``(H + h, W)``.

    Feet are the parts in the lowest ``reach`` of the height; of each, the columns that end in its lowest part are extended.
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


def _convert_uv(surface: LiftedSurface, made_rows: int, rows: int) -> LiftedSurface:
    """Convert texture coordinates from a picture with ``made_rows`` to its upper ``rows``."""
    uv = surface.uv.copy()
    uv[:, 1] = 1 - (1 - uv[:, 1]) * made_rows / rows
    return replace(surface, uv=uv)


def _deepen_feet(surface: LiftedSurface, deeper: float, reach_px: float) -> LiftedSurface:
    """Scale the depth of the lowest ``reach_px`` gradually by ``deeper``, up to the depth of the whole surface."""
    if deeper == 1.0:
        return surface
    y, z = surface.vertices[:, 1], surface.vertices[:, 2]
    down = np.clip(1 - (y - y.min()) / (2 * reach_px), 0, 1)
    most = float(np.abs(z).max() / max(np.abs(z[down > 0]).max(), 1e-9))
    vertices = surface.vertices.copy()
    vertices[:, 2] = z * (1 + (min(deeper, most) - 1) * down)
    return replace(surface, vertices=vertices)
