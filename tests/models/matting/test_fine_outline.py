"""The outline at a photo's own size: thin things, narrow shadows, edges that lenses blur; what it must not touch."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.models.matting import outline_network
from manitwin.models.matting.fine_outline import band_px, fine_outline
from manitwin.models.matting.outline_network import (
    AROUND_PX,
    NEAR_PX,
    VALUES,
    OutlineColours,
    outline_model,
    patch_windows,
    patches,
    share_near_outline,
    windows_of,
)

FINE = 4  # pixels of what is drawn for one of the photo
SIZE = (360, 480)  # of the photo


def photographed(coverage: np.ndarray, thing: tuple[float, float, float], ground: np.ndarray) -> np.ndarray:
    """Return a photo of a thing of one linear colour on a ground (H, W, 3), as a lens and JPEG leave it."""
    light = ground * (1 - coverage[..., None]) + np.array(thing) * coverage[..., None]
    light = cv2.GaussianBlur(light.astype(np.float32), (0, 0), 0.8)
    srgb = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-6) ** (1 / 2.4) - 0.055)
    noisy = 255 * srgb + np.random.default_rng(0).normal(0, 1.5, srgb.shape)
    encoded = cv2.imencode(".jpg", np.clip(noisy, 0, 255).astype(np.uint8)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 88])
    return np.ascontiguousarray(cv2.imdecode(encoded[1], cv2.IMREAD_COLOR)[..., ::-1])


def ring(width_px: float) -> np.ndarray:
    """Return the coverage (H, W) of a ring of a width, slightly oval, drawn finer than the photo."""
    fine = np.zeros((SIZE[0] * FINE, SIZE[1] * FINE), np.uint8)
    center = (SIZE[1] * FINE // 2 + 1, SIZE[0] * FINE // 2 - 2)
    cv2.ellipse(fine, center, (130 * FINE, 100 * FINE), 17, 0, 360, 255, round(width_px * FINE))
    return cv2.resize(fine.astype(np.float32) / 255, SIZE[::-1], interpolation=cv2.INTER_AREA)


def rough_mask(truth: np.ndarray) -> np.ndarray:
    """Return a mask of half the size, a pixel of its own too wide."""
    small = cv2.resize(truth.astype(np.float32), (SIZE[1] // 2, SIZE[0] // 2), interpolation=cv2.INTER_AREA) > 0.5
    return cv2.dilate(small.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0


def overlap(found: np.ndarray, truth: np.ndarray) -> float:
    return float((found & truth).sum() / (found | truth).sum())


def plain(light: float) -> np.ndarray:
    return np.full((*SIZE, 3), light, np.float32)


COLOURS = (
    ((0.02, 0.02, 0.03), 0.5, 0.95),
    ((0.6, 0.05, 0.05), 0.5, 0.95),
    ((0.3, 0.3, 0.35), 0.7, 0.95),
    ((0.7, 0.45, 0.05), 0.6, 0.9),  # as light as its ground: JPEG keeps hues at half the resolution
    ((0.8, 0.8, 0.8), 0.05, 0.8),  # its blur is as bright as the thing in sRGB: drawn too wide
)
"""Linear, of a thing and its ground, and the least overlap that is reached from a mask that is too wide."""


@pytest.mark.parametrize("width_px", [6.0, pytest.param(9.0, marks=pytest.mark.slow), 14.0])
@pytest.mark.parametrize(("thing", "ground", "least"), COLOURS)
def test_a_thin_ring_is_drawn_to_a_fraction_of_a_pixel(
    thing: tuple[float, float, float], ground: float, least: float, width_px: float
) -> None:
    coverage = ring(width_px)
    truth, photo = coverage > 0.5, photographed(coverage, thing, plain(ground))
    assert overlap(fine_outline(photo, truth) > 127, truth) > min(0.97, least + 0.05)
    rough = rough_mask(truth)
    assert overlap(cv2.resize(rough.astype(np.float32), SIZE[::-1]) > 0.5, truth) < 0.85
    assert overlap(fine_outline(photo, fine_outline(photo, rough) > 127) > 127, truth) > least


def test_a_narrow_shadow_beside_the_thing_is_none_of_it() -> None:
    coverage = ring(10.0)
    shadow = cv2.GaussianBlur(np.roll(coverage, (3, 3), (0, 1)), (0, 0), 2.0)
    ground = plain(0.5) * (1 - 0.5 * shadow[..., None])
    photo, truth = photographed(coverage, (0.6, 0.05, 0.05), ground), coverage > 0.5
    rough = cv2.dilate(truth.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    rough |= np.roll(truth, (2, 2), (0, 1))
    assert overlap(rough, truth) < 0.8
    assert overlap(fine_outline(photo, rough) > 127, truth) > 0.9


def test_what_is_far_from_the_outline_stays_as_it_is() -> None:
    photo = np.random.default_rng(1).integers(0, 255, (*SIZE, 3), dtype=np.uint8)
    mask = np.zeros(SIZE, bool)
    mask[80:280, 120:360] = True
    share = share_near_outline(photo, mask, 2)
    inside, outside = (cv2.erode(m.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0 for m in (mask, ~mask))
    assert (share[inside] == 1).all() and (share[outside] == 0).all()


def test_an_empty_mask_and_one_without_ground_around_are_no_error() -> None:
    photo = np.full((*SIZE, 3), 128, np.uint8)
    assert not fine_outline(photo, np.zeros(SIZE, bool)).any()
    assert (fine_outline(photo, np.ones(SIZE, bool)) == 255).all()


def test_a_thing_that_nothing_tells_from_its_ground_keeps_its_rough_outline() -> None:
    photo = np.full((*SIZE, 3), 128, np.uint8)
    mask = np.zeros(SIZE, bool)
    mask[100:260, 150:330] = True
    assert overlap(fine_outline(photo, mask) > 127, mask) > 0.95


def test_patches_have_the_pixels_around_where_they_are() -> None:
    rng = np.random.default_rng(2)
    values = rng.normal(size=(40, 50, VALUES + 1)).astype(np.float32)
    rows, columns = np.array([20, 3]), np.array([25, 0])
    made = patches(windows_of(values, 0, 40), rows, columns)
    assert made.shape == (2, VALUES * (NEAR_PX**2 + AROUND_PX**2) + 1)
    near = made[0, : VALUES * NEAR_PX**2].reshape(VALUES, NEAR_PX, NEAR_PX)
    around = made[0, VALUES * NEAR_PX**2 : -1].reshape(VALUES, AROUND_PX, AROUND_PX)
    assert np.array_equal(near, values[15:26, 20:31, :VALUES].transpose(2, 0, 1))
    assert around[0, 4, 4] == pytest.approx(values[19:22, 24:27, 0].mean(), abs=1e-6)
    assert around[1, 0, 8] == pytest.approx(values[7:10, 36:39, 1].mean(), abs=1e-6)
    assert made[1, -1] == values[3, 0, VALUES]


def test_values_name_the_way_from_ground_to_thing() -> None:
    coverage = ring(14.0)
    photo = photographed(coverage, (0.7, 0.1, 0.05), plain(0.5))
    sides = OutlineColours(photo, (coverage > 0.5).astype(np.float32), 2)
    values, near = sides.values(0, len(photo)), sides.near
    along = values[..., 1] + 0.5
    assert near.any() and np.median(along[coverage > 0.99]) == pytest.approx(1, abs=0.05)
    assert np.median(along[(coverage == 0) & near]) == pytest.approx(0, abs=0.1)


def test_some_rows_at_a_time_are_those_of_the_whole() -> None:
    coverage = ring(14.0)
    photo = photographed(coverage, (0.7, 0.1, 0.05), plain(0.5))
    sides = OutlineColours(photo, (coverage > 0.5).astype(np.float32), 3)
    rows, columns = np.nonzero(sides.near[100:150])
    whole = patches(patch_windows(sides, 0, len(photo)), rows + 100, columns)
    assert np.array_equal(patches(patch_windows(sides, 100, 150), rows, columns), whole)


def test_colours_that_are_worked_out_some_rows_at_a_time_are_those_of_the_whole(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    coverage = ring(14.0)
    photo = photographed(coverage, (0.7, 0.1, 0.05), plain(0.5))
    mask = (coverage > 0.5).astype(np.float32)
    monkeypatch.setattr(outline_network, "ROWS_AT_ONCE", len(photo))
    whole = OutlineColours(photo, mask, 3).values(0, len(photo))
    monkeypatch.setattr(outline_network, "ROWS_AT_ONCE", 7)
    assert np.abs(OutlineColours(photo, mask, 3).values(0, len(photo)) - whole).max() < 1e-4


def test_the_band_follows_the_photos_size() -> None:
    assert band_px((512, 640, 3), (512, 640)) == 2
    assert band_px((1024, 768), (512, 384)) == 4
    assert outline_model().startswith("outline-network sha256:")


def test_the_outline_of_a_noisy_photo_has_no_specks_and_no_pinholes() -> None:
    coverage = ring(14.0)
    photo = photographed(coverage, (0.42, 0.42, 0.42), plain(0.5))
    grain = np.random.default_rng(3).normal(0, 9, photo.shape)
    found = fine_outline(np.clip(photo + grain, 0, 255).astype(np.uint8), coverage > 0.5) > 127
    pieces = [cv2.connectedComponentsWithStats(m.astype(np.uint8), connectivity=4)[2][1:, 4] for m in (found, ~found)]
    assert min(pieces[0].min(), pieces[1].min()) >= 16
