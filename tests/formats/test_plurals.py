"""Numbers with what they count."""

from __future__ import annotations

import pytest

from manitwin.formats.plurals import counted


@pytest.mark.parametrize(
    ("count", "plural", "said"),
    [
        (1, "inputs", "1 input"),
        (0, "inputs", "0 inputs"),
        (2, "inputs", "2 inputs"),
        (1, "batches", "1 batch"),
        (1, "resting poses", "1 resting pose"),
        (1200, "rows", "1,200 rows"),
    ],
)
def test_one_thing_is_told_in_the_singular(count: int, plural: str, said: str) -> None:
    assert counted(count, plural) == said
