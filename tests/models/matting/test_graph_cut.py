"""What of a picture goes into the graph that is cut: rows and columns near something, and not what lies far between."""

from __future__ import annotations

import numpy as np

from manitwin.models.matting.segmentation import _around


def test_one_thing_is_cut_with_a_margin_around_it() -> None:
    mask = np.zeros((60, 80), bool)
    mask[20:30, 40:70] = True
    rows, columns = _around(mask, 4)
    assert rows.ravel().tolist() == list(range(16, 34)) and columns.ravel().tolist() == list(range(36, 74))


def test_what_lies_far_between_two_things_is_left_out() -> None:
    mask = np.zeros((200, 300), bool)
    mask[10:20, 280:290] = mask[150:160, 5:15] = True
    rows, columns = _around(mask, 4)
    assert rows.ravel().tolist() == [*range(6, 24), *range(146, 164)]
    assert columns.ravel().tolist() == [*range(1, 19), *range(276, 294)]
