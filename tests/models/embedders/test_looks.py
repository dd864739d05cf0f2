"""Looks: what is alike is near, whatever is behind it, and the thing is told from what is behind it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.models.classifiers.efficientnet_lite import FEATURE_LAYERS, FEATURES, features, load_weights, logits
from manitwin.models.embedders.appearance import COLOR_WEIGHT, LENGTH, NETWORK, appearance_descriptor
from manitwin.models.embedders.foreground import foreground

RED, BLUE = (190, 30, 30), (30, 40, 190)


def drawn(color: tuple[int, int, int], ground: tuple[int, int, int], side: int = 90) -> tuple[np.ndarray, np.ndarray]:
    rgb = np.full((160, 160, 3), ground, np.uint8)
    rgb += np.random.default_rng(0).integers(0, 12, rgb.shape, np.uint8)
    mask = np.zeros((160, 160), np.float32)
    cv2.circle(mask, (70, 84), side // 2, 1.0, -1)
    return np.where(mask[..., None] > 0, np.array(color, np.uint8), rgb), mask


def test_features_end_in_what_the_classifier_classifies() -> None:
    picture = drawn(RED, (120, 120, 90))[0][None, :, :]
    square = np.array([cv2.resize(picture[0], (224, 224))])
    found, weights = features(square), load_weights()
    assert found.shape == (1, FEATURES)
    begin, count = FEATURE_LAYERS["feature"]
    by_hand = found[:, begin : begin + count] @ weights["_fc.weight"].T + weights["_fc.bias"]
    assert by_hand == pytest.approx(logits(square), abs=1e-4)


def test_a_look_depends_on_the_thing_and_not_on_what_is_behind_it() -> None:
    look = appearance_descriptor(*drawn(RED, (40, 90, 40)))
    assert look.shape == (LENGTH,) and np.linalg.norm(look) == pytest.approx(1, abs=1e-5)
    behind, smaller, blue = (
        appearance_descriptor(*drawn(RED, (200, 200, 220))),
        appearance_descriptor(*drawn(RED, (40, 90, 40), 60)),
        appearance_descriptor(*drawn(BLUE, (40, 90, 40))),
    )
    assert look @ behind > 0.99 and look @ smaller > 0.9
    assert look @ blue < 0.85
    assert look[NETWORK:] @ blue[NETWORK:] < 0.1 * COLOR_WEIGHT, "red and blue share no bin of colours"
    assert (appearance_descriptor(*drawn(RED, (40, 90, 40))) == look).all()
    with pytest.raises(ValueError, match="3 pixels"):
        appearance_descriptor(np.zeros((8, 8, 3), np.uint8), np.eye(8) * (np.arange(8) < 3))


def test_the_thing_is_told_by_transparency_or_by_the_border() -> None:
    rgb, mask = drawn(RED, (40, 90, 40))
    pixels = np.dstack([rgb, (mask * 255).astype(np.uint8)])
    _, alpha, found = foreground(pixels)
    assert found == "alpha" and (alpha == mask).all()
    for opaque in (rgb, np.dstack([rgb, np.full((160, 160), 255, np.uint8)])):
        _, told, found = foreground(opaque)
        assert found == "border"
        assert (told * mask).sum() / np.maximum(told, mask).sum() > 0.97
    assert foreground(np.full((64, 64, 3), 90, np.uint8))[2] == "none"


def test_a_large_photo_is_looked_at_small() -> None:
    rgb, _ = drawn(RED, (40, 90, 40))
    small, mask, found = foreground(cv2.resize(rgb, (800, 800)))
    assert small.shape == (192, 192, 3) and mask.shape == (192, 192) and found == "border"
