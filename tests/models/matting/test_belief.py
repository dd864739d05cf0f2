"""How likely a cut-out is right: no doubt makes it likelier, and what is told as the cause is what costs the most."""

from __future__ import annotations

import json
from importlib.resources import files

import cv2
import numpy as np
import pytest

from manitwin.models.matting.belief import (
    BEST,
    FEATURES,
    SCORES,
    WEIGHTS_FILE,
    WHOLE,
    log_odds_costs,
    probability,
)
from manitwin.models.matting.study import study_photo


def test_every_feature_has_a_weight_and_none_but_the_maker_s_is_negative() -> None:
    fitted = json.loads((files("manitwin.models.matting") / WEIGHTS_FILE).read_text(encoding="utf-8"))
    assert set(fitted["weights"]) == set(FEATURES) and fitted["fitted_to"]
    assert all(value >= 0 for name, value in fitted["weights"].items() if name != "made_by_rules")


@pytest.mark.parametrize("name", FEATURES[:-1])
def test_less_of_a_feature_never_makes_a_mask_likelier(name: str) -> None:
    worse = BEST.copy()
    worse[FEATURES.index(name)] -= 0.5
    assert probability(worse) <= probability(BEST)
    fitted = json.loads((files("manitwin.models.matting") / WEIGHTS_FILE).read_text(encoding="utf-8"))
    besides = {"kept": -np.log(0.5), "solid": 0.5}.get(name, 0.0)
    assert log_odds_costs(worse)[name] == pytest.approx(0.5 * fitted["weights"][name] + besides)
    assert sum(log_odds_costs(worse).values()) == pytest.approx(log_odds_costs(worse)[name])


def test_what_is_certain_is_likelier_than_what_is_not() -> None:
    doubtful = BEST.copy()
    doubtful[: len(SCORES)] = np.log(0.3)
    assert probability(BEST) > 0.9 and probability(doubtful) < 0.5
    assert WHOLE.sum() == 1 and FEATURES[int(WHOLE.argmax())] == "whole"


def _photo(*things: tuple[tuple[int, int], tuple[int, int, int]]) -> tuple[np.ndarray, np.ndarray]:
    truth = np.zeros((300, 400), np.uint8)
    scene = np.full((300, 400, 3), (205.0, 200.0, 190.0)) + np.random.default_rng(0).normal(0, 1.5, (300, 400, 3))
    for center, color in things:
        one = cv2.ellipse(np.zeros_like(truth), center, (60, 40), 20, 0, 360, 1, -1)
        scene[one > 0] = color
        truth |= one
    return np.clip(cv2.GaussianBlur(scene, (0, 0), 0.8), 0, 255).astype(np.uint8), truth > 0


def test_the_likelier_of_the_masks_comes_first() -> None:
    photo, truth = _photo(((200, 150), (30, 90, 160)))
    study = study_photo(photo)
    assert {each.candidate.maker for each in study.judged} == {"rules", "network"}
    assert study.judged[0].confidence >= study.judged[1].confidence and study.confidence > 0.9
    found = study.alpha > 127
    assert (found & truth).sum() / (found | truth).sum() > 0.97


def test_pieces_are_told_from_ground_though_they_are_no_one_thing() -> None:
    photo, _ = _photo(((110, 150), (30, 90, 160)), ((300, 150), (160, 40, 40)))
    best = study_photo(photo).judged[0]
    assert best.candidate.scores.whole < 1 and best.pieces_confidence > max(best.confidence, 0.8)
