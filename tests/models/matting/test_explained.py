"""A doubtful cut-out is believed where it has the outline of the thing that it is said to be, and for no other reason."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
import pytest

from kept_opinions import kept_opinions
from manitwin.errors import Rejected
from manitwin.models.generators.templates.fitting import outline_check
from manitwin.models.generators.templates.fitting.outline_check import template_outline_check
from manitwin.models.matting import matte_photo
from manitwin.models.matting.study import EXPLAINED_ODDS, study_photo

SIZE = (300, 400)
CENTER, RADIUS_PX = (200, 150), 70


@pytest.fixture(scope="module", autouse=True)
def rules_and_the_built_in_network_asked_once() -> Iterator[None]:
    """Keep what they say of a picture: one is studied by itself, and with what explains it or does not."""
    with kept_opinions():
        yield


@dataclass
class Says:
    """An answer, and the cut-outs that it was asked about."""

    answer: bool
    asked: list[np.ndarray] = field(default_factory=list)

    def __call__(self, rgba: np.ndarray) -> bool:
        self.asked.append(rgba)
        return self.answer


def scene(*disks: tuple[tuple[int, int], int]) -> np.ndarray:
    """Blue disks on an unevenly lit wall."""
    light = np.linspace(1.0, 0.78, SIZE[1])[None, :, None]
    picture = np.array([206.0, 198.0, 188.0]) * light + np.random.default_rng(0).normal(0, 1.5, (*SIZE, 3))
    for center, radius_px in disks:
        picture[disk(center, radius_px)] = (40, 90, 160)
    return np.clip(cv2.GaussianBlur(picture, (0, 0), 0.8), 0, 255).astype(np.uint8)


def disk(center: tuple[int, int], radius_px: int) -> np.ndarray:
    return cv2.circle(np.zeros(SIZE, np.uint8), center, radius_px, 1, -1).astype(bool)


def test_doubtful_cut_out_is_believed_where_a_shape_explains_it_and_says_so() -> None:
    picture = scene((CENTER, RADIUS_PX))
    by_itself = study_photo(picture).confidence
    assert 0.9 < by_itself < 0.99
    says = Says(True)
    matte = matte_photo(picture, "x.png", min_confidence=0.99, explains=says)
    assert len(says.asked) == 1
    assert (says.asked[0] == matte.rgba).all()
    odds = EXPLAINED_ODDS * by_itself / (1 - by_itself)
    assert matte.confidence == pytest.approx(odds / (1 + odds), abs=1e-4)
    assert any(f"doubtful by itself ({by_itself:.2f})" in finding for finding in matte.findings)


@pytest.mark.slow
def test_shape_that_explains_none_changes_nothing() -> None:
    picture, says = scene((CENTER, RADIUS_PX)), Says(False)
    with pytest.raises(Rejected, match="cannot be told from the background"):
        matte_photo(picture, "x.png", min_confidence=0.99, explains=says)
    assert says.asked


def test_what_is_believed_by_itself_is_not_asked_about() -> None:
    says = Says(True)
    matte = matte_photo(scene((CENTER, RADIUS_PX)), "x.png", explains=says)
    assert not says.asked
    assert not any("doubtful" in finding for finding in matte.findings)


@pytest.mark.parametrize(
    "disks", [((CENTER, 60), ((70, 150), 40)), (((20, 150), RADIUS_PX),)], ids=["two things", "cut by the frame"]
)
def test_shape_speaks_for_no_thing_beside_another_or_cut_by_the_frame(
    disks: tuple[tuple[tuple[int, int], int], ...],
) -> None:
    says = Says(True)
    with pytest.raises(Rejected):
        matte_photo(scene(*disks), "x.png", min_confidence=0.99, explains=says)
    assert not says.asked


def test_outline_of_a_template_is_told_from_one_with_a_shadow_or_without_a_part() -> None:
    explains = template_outline_check("plate")
    assert explains is not None
    whole = np.zeros((400, 400), np.uint8)
    cv2.ellipse(whole, (200, 200), (150, 70), 0, 0, 360, 255, -1)
    with_shadow, less = whole.copy(), whole.copy()
    cv2.ellipse(with_shadow, (250, 225), (120, 60), 0, 0, 360, 255, -1)
    less[:, 280:] = 0
    said = [explains(np.dstack([np.full((400, 400, 3), 160, np.uint8), mask])) for mask in (whole, with_shadow, less)]
    assert said == [True, False, False]


@pytest.mark.parametrize(("name", "may_be_a_cap"), [("hat", True), ("sun hat", False)])
def test_outline_of_what_a_longer_name_does_not_mean_is_no_evidence(
    monkeypatch: pytest.MonkeyPatch, name: str, may_be_a_cap: bool
) -> None:
    asked: list[str] = []

    def fit(category: str, rgba: np.ndarray, *, or_of: Sequence[str], focal_mm: float | None) -> None:
        asked.extend([category, *or_of])

    monkeypatch.setattr(outline_check, "fit", fit)
    explains = template_outline_check(name)
    assert explains is not None and not explains(np.zeros((8, 8, 4), np.uint8))
    assert asked[0] == "hat" and ("cap" in asked) == may_be_a_cap


def test_what_has_no_template_has_no_outline() -> None:
    assert template_outline_check(None) is None
    assert template_outline_check("figurine of a cat") is None
