"""What a network says of all of a ground of one digital colour alike is no doubt; what it says of one place stays one."""

import cv2
import numpy as np

from manitwin.models.matting.uniform_background import subtract_haze

SIDE_PX = 200
BLACK = np.zeros(3, np.float32)
THING = np.s_[60:140, 70:130]
DARK_PART = np.s_[140:170, 70:130]


def _picture() -> np.ndarray:
    """A grey thing (200, 200, 3) uint8 on black; a part below it is black too."""
    rgb = np.zeros((SIDE_PX, SIDE_PX, 3), np.uint8)
    rgb[THING] = 130
    return rgb


def _share(haze: float) -> np.ndarray:
    share = np.random.default_rng(0).uniform(0, haze, (SIDE_PX, SIDE_PX)).astype(np.float32)
    share[THING] = 0.97
    return share


def test_haze_over_all_of_the_ground_is_taken_off() -> None:
    cleared = subtract_haze(_share(0.2), _picture(), BLACK)
    ground = _picture().max(axis=2) == 0
    assert cleared[ground].mean() < 0.005 < 0.09 < _share(0.2)[ground].mean()
    assert (cleared[THING] == _share(0.2)[THING]).all(), "what has another colour is as it was"


def test_what_is_said_of_one_dark_place_stays_a_doubt() -> None:
    share = _share(0.1)
    share[DARK_PART] = 0.45
    cleared = subtract_haze(share, _picture(), BLACK)
    assert cleared[DARK_PART].min() > 0.35


def test_a_network_that_is_sure_of_the_frame_is_heard() -> None:
    share = _share(0.1)
    share[:, :20] = 0.9
    share[:20] = 0.9
    cleared = subtract_haze(share, _picture(), BLACK)
    assert cleared[:20].min() > 0.8


def test_the_share_may_be_of_another_size_and_the_picture_without_ground_at_its_frame() -> None:
    small = cv2.resize(_share(0.2), (96, 96), interpolation=cv2.INTER_AREA)
    assert subtract_haze(small, _picture(), BLACK).shape == (96, 96)
    lit = np.full((SIDE_PX, SIDE_PX, 3), 90, np.uint8)
    assert (subtract_haze(_share(0.2), lit, BLACK) == _share(0.2)).all()
