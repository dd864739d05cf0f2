"""Doubts about masks: measured on made scenes with a mask that is right, and with ones that are wrong in a known way."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np

from manitwin.models.matting.doubts import LIMITS, Doubts, doubts_of
from manitwin.models.matting.segmentation import Segmentation, segment

SIZE = (200, 260)
GROUND = np.array([186.0, 190, 196])
BODY, CAP = np.s_[90:160, 90:170], np.s_[60:90, 95:165]
TEETH = tuple(np.s_[90:130, x : x + 4] for x in range(96, 166, 9))


@lru_cache
def _jar(slotted: bool) -> tuple[Segmentation, np.ndarray]:
    """Return what is found in a photo of an orange jar with a cap a little paler than the ground, and the jar's true mask."""
    light = np.tile(GROUND, (*SIZE, 1))
    truth = np.zeros(SIZE, bool)
    for place, colour in ((BODY, (196, 110, 50)), (CAP, (222, 222, 218))):
        light[place], truth[place] = colour, True
    for tooth in TEETH if slotted else ():
        light[tooth], truth[tooth] = 0.8 * GROUND, False
    light = cv2.GaussianBlur(light, (0, 0), 0.7) + np.random.default_rng(0).normal(0, 0.5, light.shape)
    return segment(np.clip(light, 0, 255).astype(np.uint8)), truth


def _doubts(slotted: bool, mask: np.ndarray) -> Doubts:
    return doubts_of(replace(_jar(slotted)[0], mask=mask))


def test_right_mask_is_not_doubted() -> None:
    found = _doubts(False, _jar(False)[1])
    assert found.edges_beyond == 0 and found.slots < 0.2 * LIMITS.slots and found.thinness < LIMITS.thinness


def test_lost_cap_leaves_edges_as_sharp_as_the_outline() -> None:
    without = _jar(False)[1].copy()
    without[CAP] = False
    assert _doubts(False, without).edges_beyond > 1.3 * LIMITS.edges_beyond


def test_filled_slots_are_seen_and_open_ones_are_none() -> None:
    truth = _jar(True)[1]
    filled = truth.copy()
    filled[BODY] = True
    assert _doubts(True, filled).slots > 1.5 * LIMITS.slots
    assert _doubts(True, truth).slots < LIMITS.slots


def test_thin_thing_is_doubted_in_a_small_photo_and_not_in_a_fine_one() -> None:
    found, _ = _jar(False)
    thin = np.zeros(SIZE, bool)
    thin[20:180, 60:72] = True
    small, fine = (doubts_of(replace(found, mask=thin), zoom=zoom).thinness for zoom in (1.0, 4.0))
    assert small > LIMITS.thinness > fine and abs(small - 2 * (160 + 10) / (160 * 12)) < 1e-9
