"""How episodes are dealt out: a number decides its twin, whatever was asked for before."""

from __future__ import annotations

import itertools

import pytest

from manitwin.episodes.batch import Batch, missing_batches
from manitwin.errors import UsageError


def _twins(dealt: list[Batch]) -> dict[int, str]:
    numbers = [(number, batch.source_id) for batch in dealt for number in batch.numbers]
    assert len(dict(numbers)) == len(numbers)
    return dict(numbers)


@pytest.mark.parametrize("size", [1, 2, 3, 10])
def test_steps_make_what_one_go_makes(size: int) -> None:
    ids, there = ["a", "b", "c", "d"], list[Batch]()
    for count in (4, 6, 8, 29, 30, 20):
        there += missing_batches("panda", count, size, twin_ids=ids, there=there)
    assert _twins(there) == _twins(missing_batches("panda", 30, size, twin_ids=ids))
    assert _twins(there) == dict(zip(range(30), itertools.cycle(ids), strict=False))
    assert max(batch.count for batch in there) <= size


def test_a_twin_that_came_later_catches_up_and_batches_go_round() -> None:
    there = missing_batches("panda", 8, 2, twin_ids=["a", "b"])
    assert [batch.source_id for batch in there] == ["a", "b", "a", "b"]
    more = missing_batches("panda", 15, 2, twin_ids=["a", "new", "b"], there=there)
    assert sorted(_twins([*there, *more])) == list(range(15))
    assert [number for number, each in _twins(more).items() if each == "new"] == [8, 9, 10, 11, 13]


def test_a_batch_of_an_older_version_keeps_its_id() -> None:
    assert "step" not in Batch("panda", 0, 2, twin_id="a").to_json()
    strided = Batch("panda", 0, 2, twin_id="a", step=4)
    assert Batch.from_json(strided.to_json()) == strided


def test_batches_of_older_versions_that_repeat_each_other_are_refused() -> None:
    there = [Batch("panda", 0, 1, twin_id="a"), Batch("panda", 0, 2, twin_id="a")]
    with pytest.raises(UsageError, match=r"repeats episodes of another one; .*new folder"):
        missing_batches("panda", 8, 2, twin_ids=["a"], there=there)
