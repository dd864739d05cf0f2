"""What is worked out once of a ground and asked by several rules: light and tint, and sums of components as NumPy has them."""

import cv2
import numpy as np
import pytest

from manitwin.models.matting.background import model_background, total


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(24, 32, 3), (300, 3), (40, 50, 3)])
def test_sums_of_components_are_numpys_to_the_last_bit(kind: type, shape: tuple[int, ...]) -> None:
    vectors = np.random.default_rng(0).normal(0, 50, shape).astype(kind)
    found = total(vectors)
    assert found.dtype == kind and np.array_equal(found, vectors.sum(-1))
    assert np.array_equal(found / 3, vectors.mean(-1))


def test_light_and_tint_of_a_ground_are_those_of_its_ratio_and_kept() -> None:
    rgb = np.full((96, 128, 3), (210, 200, 190), np.uint8)
    cv2.circle(rgb, (64, 48), 20, (60, 90, 160), -1)
    rgb[74:80, 30:100] = rgb[74:80, 30:100] * 0.7
    ground = model_background(rgb)
    ratio = ground.light_ratio
    even = ratio.mean(2)
    assert np.array_equal(ground.light, even) and ground.light is ground.light
    tint = np.linalg.norm(ratio / even[..., None] - 1, axis=2) / np.sqrt(3)
    assert ground.tint == pytest.approx(tint, abs=1e-6) and ground.tint is ground.tint
    assert ground.shade[76:78, 34:96].all() and not ground.shade[48, 64]
