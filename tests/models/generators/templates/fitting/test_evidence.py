"""Distances to an outline, as fits compare them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.models.generators.templates.fitting.evidence import (
    OVERSAMPLING,
    REACH,
    SIDE_PX,
    fill_small_holes,
    signed_distance,
)

SIDE = OVERSAMPLING * SIDE_PX
MASKS = {
    "slim": ((30, 110, 12, 4), 0),
    "upright": ((110, 30, 6, 150), 0),
    "slanted": ((60, 60, 90, 9), 30),
    "small": ((101, 57, 5, 3), 0),
    "at the corner": ((0, 0, 40, 25), 0),
    "at the far corner": ((SIDE - 9, SIDE - 30, 9, 30), 0),
    "all": ((0, 0, SIDE, SIDE), 0),
    "nothing": ((0, 0, 0, 0), 0),
}


@pytest.mark.parametrize("name", MASKS)
def test_a_distance_is_that_of_the_whole_picture(name: str) -> None:
    (left, top, width, height), degrees = MASKS[name]
    mask = np.zeros((SIDE, SIDE), np.uint8)
    mask[top : top + height, left : left + width] = 1
    if degrees:
        turn = cv2.getRotationMatrix2D((SIDE / 2, SIDE / 2), degrees, 1.0)
        mask = cv2.warpAffine(mask, turn, (SIDE, SIDE), flags=cv2.INTER_NEAREST)
    away = cv2.distanceTransform(mask, cv2.DIST_L2, 3) - cv2.distanceTransform(1 - mask, cv2.DIST_L2, 3)
    whole = np.clip(away[1 :: 2 * OVERSAMPLING, 1 :: 2 * OVERSAMPLING] / (REACH * SIDE), -1, 1)
    assert np.array_equal(signed_distance(mask), whole)


def test_small_holes_are_filled_and_a_loop_is_not() -> None:
    mask = np.zeros((SIDE, SIDE), bool)
    mask[40:180, 40:180] = True
    whole = mask.copy()
    mask[60:66, 60:66] = mask[100:104, 90:98] = False
    mask[120:160, 120:160] = whole[120:160, 120:160] = False
    assert np.array_equal(fill_small_holes(mask), whole)
    assert fill_small_holes(whole) is whole
