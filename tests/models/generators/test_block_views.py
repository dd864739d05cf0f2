"""Blocks whose outline is that of a photo."""

from __future__ import annotations

from itertools import product

import cv2
import numpy as np
import pytest

from manitwin.models.generators.lift.block_views import DIRECTION_COUNT, block_views, outline_points
from manitwin.models.generators.templates.fitting.view import View, normalised

SIDE_PX = 600


def _mask(width: float, depth: float, elevation_deg: float, yaw_deg: float, perspective: float = 0.2) -> np.ndarray:
    """The outline of a block by its width and depth over its height."""
    corners = np.array(list(product((0, width), (0, depth), (0, 1.0))))
    points, _, _ = normalised(corners)
    flat, _ = View(np.radians(yaw_deg), np.radians(elevation_deg), 0.0, perspective).project(points)
    flat = (flat - (flat.min(0) + flat.max(0)) / 2) / np.ptp(flat, axis=0).max()
    mask = np.zeros((SIDE_PX, SIDE_PX), np.uint8)
    cv2.fillConvexPoly(mask, cv2.convexHull(np.rint(0.9 * SIDE_PX * flat + SIDE_PX / 2).astype(np.int32)), 1)
    return mask > 0


@pytest.mark.parametrize("elevation_deg", [15.0, 35.0, 60.0])
@pytest.mark.parametrize(("width", "depth"), [(0.35, 0.35), (0.6, 0.3), (1.0, 1.0), (2.4, 1.8), (5.0, 3.0)])
@pytest.mark.parametrize("yaw_deg", [-35.0, 20.0])
def test_a_block_is_among_those_that_its_outline_may_be_of(
    width: float, depth: float, elevation_deg: float, yaw_deg: float
) -> None:
    found = block_views(_mask(width, depth, elevation_deg, yaw_deg), perspective=0.32, focal_spread=0.45)
    errors = [np.abs(np.log([each.width / width, each.depth / depth])).max() for each in found]
    assert min(errors) < 0.08
    nearest = found[int(np.argmin(errors))]
    assert np.degrees(nearest.view.elevation_rad) == pytest.approx(elevation_deg, abs=4)
    assert np.degrees(nearest.view.yaw_rad) == pytest.approx(yaw_deg, abs=5)
    assert nearest.silhouette_error < 0.002


def test_the_view_of_a_block_shows_its_outline() -> None:
    mask = _mask(1.4, 0.6, 40.0, 30.0)
    best = block_views(mask, perspective=0.32, focal_spread=0.45)[0]
    corners, _, _ = normalised(np.array(list(product((0, best.width), (0, best.depth), (0, 1.0)))))
    flat, _ = best.view.project(corners)
    angles = 2 * np.pi * np.arange(DIRECTION_COUNT) / DIRECTION_COUNT
    ways = np.stack([np.cos(angles), np.sin(angles)])
    off = (flat @ ways).max(0) - (outline_points(mask) @ ways).max(0)
    assert np.sqrt((off**2).mean()) == pytest.approx(best.silhouette_error, rel=1e-6)


def test_no_block_has_the_outline_of_a_disc_or_of_a_triangle() -> None:
    disc, triangle = (np.zeros((SIDE_PX, SIDE_PX), np.uint8) for _ in range(2))
    cv2.circle(disc, (300, 300), 200, 1, -1)
    cv2.fillConvexPoly(triangle, np.array([[300, 80], [520, 500], [80, 500]]), 1)
    for mask in (disc, triangle):
        assert block_views(mask > 0, perspective=0.3, focal_spread=0.45) == []


def test_the_same_outline_gives_the_same_blocks() -> None:
    mask = _mask(1.0, 0.7, 25.0, 10.0)
    assert block_views(mask, 0.3, 0.45) == block_views(mask, 0.3, 0.45)
