"""Masks dilated and eroded by disks: large disks are applied row by row, and give what OpenCV gives."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.models.matting.outline import BY_ROWS_FROM_PX, dilated, disk, eroded, opened


def _blobs(height: int, width: int) -> np.ndarray:
    noise = np.random.default_rng(3).random((height, width)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 6)
    return np.asarray(smooth > np.quantile(smooth, 0.7))


@pytest.mark.parametrize("radius", [1, BY_ROWS_FROM_PX - 1, BY_ROWS_FROM_PX, 17, 150])
@pytest.mark.parametrize("size", [(90, 140), (40, 300)])
def test_disks_of_any_size_are_opencvs(radius: int, size: tuple[int, int]) -> None:
    mask = _blobs(*size)
    numbers = mask.astype(np.uint8)
    assert np.array_equal(dilated(mask, radius), cv2.dilate(numbers, disk(radius)) > 0)
    assert np.array_equal(eroded(mask, radius), cv2.erode(numbers, disk(radius)) > 0)
    assert np.array_equal(opened(mask, radius), cv2.morphologyEx(numbers, cv2.MORPH_OPEN, disk(radius)) > 0)


def test_the_mask_that_is_given_stays_as_it_is() -> None:
    mask = _blobs(60, 60)
    before = mask.copy()
    dilated(mask, 20)
    eroded(mask, 20)
    assert np.array_equal(mask, before)
