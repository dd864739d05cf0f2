"""What is made of hulls is made once while trials stay with the same object."""

from __future__ import annotations

import numpy as np

from manitwin.physics.trial import KeptForHulls


def test_made_once_for_the_same_hulls_and_anew_for_others() -> None:
    asked: list[int] = []

    def count(hulls: tuple[np.ndarray, ...]) -> int:
        asked.append(len(hulls))
        return len(hulls)

    kept, pair, single = KeptForHulls(count), (np.zeros((4, 3)), np.ones((4, 3))), (np.zeros((4, 3)),)
    assert [kept(pair), kept(pair), kept(single), kept(single), kept(pair)] == [2, 2, 1, 1, 2]
    assert asked == [2, 1, 2]
