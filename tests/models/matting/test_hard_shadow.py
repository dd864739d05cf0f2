"""Hard cast shadows beside drawn objects whose mask is known: shadows go, grey and dark parts stay."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import cv2
import numpy as np
import pytest

from kept_opinions import kept_opinions
from manitwin.errors import Rejected
from manitwin.models.matting import matte_photo
from manitwin.models.matting.study import study_photo

SIZE = (384, 512)
LENS_PX = 0.7  # the blur of a photo in focus
PENUMBRA_PX = 2.0  # the blur of a shadow's edge, before the lens
ATTACHED_SHADOW = (22, 26)  # how far the shadow of the body lies from it, in pixels (x, y)


@pytest.fixture(scope="module", autouse=True)
def rules_and_the_built_in_network_asked_once() -> Iterator[None]:
    """Keep what they say of a picture: a photo is cut out, and what was found is looked at again."""
    with kept_opinions():
        yield


def _plain(seed: int) -> np.ndarray:
    """A warm table, brighter to the left, in linear light, with sensor noise to come."""
    x = np.linspace(1.0, 0.8, SIZE[1])[None, :, None]
    return np.broadcast_to(np.array([0.62, 0.56, 0.48]) * x, (*SIZE, 3)).copy()


def _woven(seed: int) -> np.ndarray:
    """The same table under a cloth: fine texture of a few per cent."""
    texture = cv2.GaussianBlur(np.random.default_rng(seed).normal(0, 1, SIZE), (0, 0), 1.2)
    return _plain(seed) * (1 + 0.12 * texture[..., None])


def _polygon(points: list[tuple[float, float]]) -> np.ndarray:
    mask = np.zeros(SIZE, np.uint8)
    cv2.fillPoly(mask, [np.round(np.array(points)).astype(np.int32)], 1)
    return mask.astype(np.float32)


BODY = _polygon([(130, 110), (330, 80), (350, 150), (360, 230), (300, 270), (160, 240)])


def _shadow(
    mask: np.ndarray, light: tuple[float, float, float], shift: tuple[int, int] = ATTACHED_SHADOW
) -> np.ndarray:
    """The light that is left (H, W, 3) where ``mask`` moved by ``shift`` hides the lamp."""
    moved = cv2.warpAffine(mask, np.array([[1, 0, shift[0]], [0, 1, shift[1]]], np.float32), SIZE[::-1])
    hidden = cv2.GaussianBlur(moved, (0, 0), PENUMBRA_PX)[..., None]
    return 1 - hidden * (1 - np.array(light))


def _photo(linear: np.ndarray, seed: int = 0) -> np.ndarray:
    pixels = 255 * np.clip(cv2.GaussianBlur(linear, (0, 0), LENS_PX), 0, 1) ** (1 / 2.2)
    noise = np.random.default_rng(seed + 1).normal(0, 1.0, linear.shape)
    return np.clip(pixels + noise, 0, 255).astype(np.uint8)


def _painted(scene: np.ndarray, mask: np.ndarray, colour: tuple[float, float, float]) -> np.ndarray:
    return np.where(mask[..., None] > 0, np.array(colour), scene)


def _overlap(photo: np.ndarray, truth: np.ndarray) -> float:
    found = matte_photo(photo, "x.png").rgba[..., 3] > 127
    return float((found & (truth > 0)).sum() / (found | (truth > 0)).sum())


@pytest.mark.parametrize(
    "light",
    [
        (0.7, 0.7, 0.7),
        pytest.param((0.5, 0.5, 0.5), marks=pytest.mark.slow),
        pytest.param((0.35, 0.35, 0.35), marks=pytest.mark.slow),
        (0.46, 0.5, 0.54),
    ],
)
@pytest.mark.parametrize(
    ("table", "colour"),
    [
        (_plain, (0.02, 0.02, 0.022)),
        pytest.param(_plain, (0.03, 0.10, 0.45), marks=pytest.mark.slow),
        (_woven, (0.02, 0.02, 0.022)),
    ],
    ids=["black", "blue", "black on cloth"],
)
def test_hard_shadow_is_left_out(
    table: Callable[[int], np.ndarray], light: tuple[float, float, float], colour: tuple[float, float, float]
) -> None:
    scene = _painted(table(3) * _shadow(BODY, light), BODY, colour)
    # with its shadow the object would have an overlap of 0.82
    assert _overlap(_photo(scene), BODY) > 0.95


@pytest.mark.parametrize(
    ("light", "grey", "cause"),
    [
        (0.45, 0.16, "a shadow may hang on it"),  # it is darker than its shadow
        pytest.param(0.45, 0.3, "a shadow may hang on it", marks=pytest.mark.slow),
        pytest.param(0.7, 0.3, "a shadow may hang on it", marks=pytest.mark.slow),
    ],
)
def test_object_as_grey_as_its_hard_shadow_is_rejected_for_it(light: float, grey: float, cause: str) -> None:
    scene = _painted(_plain(0) * _shadow(BODY, (light, light, light)), BODY, (1.12 * grey, grey, 0.87 * grey))
    with pytest.raises(Rejected, match=cause) as caught:
        matte_photo(_photo(scene), "x.png")
    assert caught.value.reason == "low_confidence_matte"


@pytest.mark.slow
def test_object_much_darker_than_its_hard_shadow_is_told_from_it() -> None:
    scene = _painted(_plain(0) * _shadow(BODY, (0.7, 0.7, 0.7)), BODY, (0.18, 0.16, 0.14))
    assert _overlap(_photo(scene), BODY) > 0.97


@pytest.mark.slow
@pytest.mark.parametrize(
    "grey", [pytest.param(0.08, marks=pytest.mark.slow), 0.16, pytest.param(0.3, marks=pytest.mark.slow)]
)
def test_grey_object_without_a_shadow_is_whole(grey: float) -> None:
    assert _overlap(_photo(_painted(_plain(0), BODY, (1.12 * grey, grey, 0.87 * grey))), BODY) > 0.97


@pytest.mark.parametrize("share", [0.25, pytest.param(0.4, marks=pytest.mark.slow), 0.6])
def test_grey_blade_of_a_coloured_handle_stays_or_the_photo_is_rejected(share: float) -> None:
    """The blade has exactly the background's colour, dimmed: only its sharp outline tells it from a shadow.

    It is found whole. Where the network calls it a shadow, the two ways of looking differ, and it may not be believed.
    """
    blade = _polygon([(330, 110), (470, 170), (470, 182), (350, 170)])
    scene = _painted(_plain(0), BODY, (0.03, 0.10, 0.45))
    scene = np.where((blade > 0)[..., None], _plain(0) * share, scene)
    photo, truth = _photo(scene), np.maximum(BODY, blade) > 0.5
    found = study_photo(photo).alpha > 127
    assert (found & truth).sum() / (found | truth).sum() > 0.96
    try:
        matte_photo(photo, "x.png")
    except Rejected as rejection:
        assert rejection.reason == "low_confidence_matte" and "do not agree" in rejection.detail


@pytest.mark.parametrize(("share", "cause"), [(0.3, "a shadow may hang on it"), (0.5, "takes more for it")])
def test_grey_stripe_along_a_coloured_body_is_not_cut_off(share: float, cause: str) -> None:
    """A stripe where a shadow would be, dimmed as a shadow would be, with an outline as sharp as a very small lamp's shadow.

    Whole, or not believed: for the shadow that it may be, or since only one way of looking takes it for the thing.
    """
    stripe = np.clip(cv2.dilate(BODY, np.ones((25, 1), np.uint8)) - BODY, 0, 1)
    stripe[:170] = 0
    scene = _painted(_plain(0), BODY, (0.03, 0.10, 0.45))
    scene = np.where((stripe > 0)[..., None], _plain(0) * share, scene)
    try:
        assert _overlap(_photo(scene), np.maximum(BODY, stripe)) > 0.97
    except Rejected as rejection:
        assert rejection.reason == "low_confidence_matte" and cause in rejection.detail


def test_black_object_without_a_shadow_is_whole() -> None:
    assert _overlap(_photo(_painted(_plain(0), BODY, (0.01, 0.01, 0.01))), BODY) > 0.97


def test_object_near_the_frame_takes_no_background_with_it() -> None:
    """Between a corner and the frame is less room than the flood's ball needs."""
    body = _polygon([(5, 190), (250, 60), (420, 190), (250, 320)])
    photo = _photo(_painted(_plain(0), body, (0.03, 0.10, 0.45)))
    assert _overlap(photo, body) > 0.975
    assert (matte_photo(photo, "x.png").rgba[:, :3, 3] < 128).all()
