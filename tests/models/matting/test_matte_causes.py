"""Why a cut-out is not believed: the doubt that costs it the most, or what may be why opinions differ."""

from __future__ import annotations

from dataclasses import fields, replace

import cv2
import numpy as np
import pytest

from manitwin.models.matting.belief import BEST, FEATURES, log_odds_costs
from manitwin.models.matting.candidates import Candidate
from manitwin.models.matting.confidence import MatteScores, frame_cause, score
from manitwin.models.matting.rejection_causes import CAUSES, HOLES, main_cause, told
from manitwin.models.matting.segmentation import segment
from manitwin.models.matting.study import study_photo

PERFECT = MatteScores(**{field.name: 1.0 for field in fields(MatteScores)})


def _with(**values: float) -> np.ndarray:
    features = BEST.copy()
    for name, value in values.items():
        features[FEATURES.index(name)] = value
    return features


def test_the_score_that_costs_the_most_is_the_cause() -> None:
    assert main_cause(_with(uncut=-3.0, network_beyond=-0.1), PERFECT) == "uncut"


def test_opinions_that_differ_are_explained_by_the_lowest_score() -> None:
    differing = _with(network_beyond=-4.0)
    assert main_cause(differing, replace(PERFECT, sharply_bounded=0.1, crisp=0.3)) == "sharply_bounded"
    assert main_cause(differing, replace(PERFECT, solid=0.2, crisp=0.3)) == "solid"
    assert main_cause(_with(network_beyond=-4.0, network_alike=-4.0), replace(PERFECT, crisp=0.9)) == "stable"


def test_equally_low_scores_are_told_in_the_order_of_the_causes() -> None:
    differing = _with(network_beyond=-4.0)
    assert list(CAUSES).index("sharply_bounded") < list(CAUSES).index("outermost")
    assert main_cause(differing, replace(PERFECT, outermost=0.0, sharply_bounded=0.0)) == "sharply_bounded"


@pytest.mark.parametrize("doubt", log_odds_costs(BEST))
def test_each_doubt_has_a_true_sentence(doubt: str) -> None:
    """Where opinions are alike but for a trifle, no cause says that they do not agree."""
    cause = main_cause(_with(**{doubt: -0.9}), replace(PERFECT, stable=0.3))
    assert cause in CAUSES and cause != "stable"


def test_a_thin_thing_is_called_thin() -> None:
    assert main_cause(_with(bulk=-1.0, rival=-2.9, network_beyond=-0.4), PERFECT) == "bulk"


def test_what_one_opinion_says_is_told_where_they_mostly_agree() -> None:
    assert main_cause(_with(network_beyond=-2.7, network_alike=-2.5), PERFECT) == "network_beyond"
    assert main_cause(_with(network_within=-2.7, network_alike=-2.5), PERFECT) == "network_within"
    assert main_cause(_with(network_within=-2.7, rival=-4.5), PERFECT) == "stable"


def _photo(
    things: list[tuple[int, int, int, int]], *, ground: int = 225, size: tuple[int, int] = (384, 512)
) -> np.ndarray:
    scene = np.full((*size, 3), float(ground))
    for left, top, right, bottom in things:
        scene[top:bottom, left:right] = (40, 90, 160)
    noise = np.random.default_rng(0).normal(0, 1.5, scene.shape)
    return np.clip(cv2.GaussianBlur(scene, (0, 0), 0.8) + noise, 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("beside", "cause"), [((360, 0, 480, 80), "beside"), ((160, 0, 340, 120), "uncut")])
def test_a_thing_beside_at_the_border_is_not_the_thing_cut_off(beside: tuple[int, int, int, int], cause: str) -> None:
    """The mask is both rectangles, as a network has it that takes both for things."""
    photo = _photo([(160, 120, 340, 290), beside])
    found = replace(segment(photo), mask=photo.mean(2) < 150)
    candidate = Candidate("network", found, score(found))
    assert candidate.scores.uncut < 0.5
    said = told(candidate, _with(uncut=-3.9, whole=-3.9 if cause == "beside" else 0.0))
    assert CAUSES[cause] in said
    assert ("crop" in said) == (cause == "beside")


def test_a_ground_that_runs_across_the_frame_does_not_cut_the_thing_off() -> None:
    photo = _photo([(200, 130, 330, 250)])
    photo[:, :20] //= 3
    photo[:, 60:80] //= 3
    photo = cv2.GaussianBlur(photo, (0, 0), 0.8)
    first = study_photo(photo).judged[0]
    assert frame_cause(first.candidate.found.background, first.candidate.found.gradient) == "uncut"
    assert first.candidate.scores.uncut > 0.9
    assert CAUSES["uncut"] not in told(first.candidate, first.features)


def test_the_remedy_of_a_thin_thing_is_what_can_make_its_picture_larger() -> None:
    thin = _with(bulk=-1.0)
    for photo, ways in (
        (_photo([(100, 184, 300, 190)]), ("larger photo", "closer")),
        (_photo([(20, 184, 495, 190)]), ("larger photo",)),
        (cv2.resize(_photo([(20, 184, 495, 190)]), None, fx=2, fy=2), ()),
    ):
        found = segment(cv2.resize(photo, (512, 384)))
        said = told(Candidate("rules", found, score(found), zoom=photo.shape[1] / 512), thin)
        assert CAUSES["bulk"] in said
        assert [way for way in ("larger photo", "closer") if way in said] == list(ways)


def test_a_mask_that_is_thin_by_its_holes_may_have_lost_parts_of_the_grounds_colour() -> None:
    """A bottle as pale as its ground is a frame to the rules; so is a picture frame, which looks no other way."""
    photo = _photo([(150, 80, 350, 310)])
    photo[86:304, 156:344] = photo[20:238, 20:208]
    found = segment(photo)
    frame = replace(found, mask=photo.mean(2) < 150)
    said = told(Candidate("rules", frame, score(frame)), _with(bulk=-1.0))
    assert f"{CAUSES['bulk']}, {HOLES};" in said and said.endswith("or photograph it on a surface of another colour")
