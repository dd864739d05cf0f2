"""Every reader against mutated files: an answer or an error of the tree, within 10 s of processor time and 1.5 GB of memory.

A failing case is printed with the command that reads it again (``fuzz_run.py``). With ``-m slow`` 10,000 a format
are read.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from fuzz_harness import all_targets, fuzz, fuzz_cases

CASES, SLOW_CASES = 12, 10_000
SHARED_CASES = 1_000
TARGETS = all_targets()

NOT_YET = frozenset[str]()
"""Readers that are being mended; this list is to be empty."""


def count(name: str, cases: int) -> int:
    return max(4, int(cases * TARGETS[name].weight))


NAMES = [pytest.param(name, marks=pytest.mark.xfail if name in NOT_YET else ()) for name in TARGETS]


FAILED_ONCE = {
    "answer-cache": (12,),
    "asset-manitwin100k": (63,),
    "asset-own-urdf": (3,),
    "asset-robotwin": (38,),
    "catalogue": (167, 1409, 1831, 3181),
    "clip": (520,),
    "collect-list": (5476,),
    "gif": (105,),
    "gltf": (18, 23),
    "index": (0,),
    "index-rows": (52, 2071),
    "hdf5": (4, 17, 49, 139, 291),
    "lerobot": (0, 2, 7, 24, 33, 53, 54, 70, 939),
    "manifest": (15, 211),
    "mtl": (31,),
    "obj": (2,),
    "png": (142, 295, 485),
    "pool": (0, 19),
    "prompts": (1,),
    "replay": (0, 2, 52),
    "robots": (98, 391, 666),
    "settings": (23,),
    "stl": (25, 93),
    "reviews": (112, 1020),
    "survey": (44, 80, 173, 276),
    "tiff": (47,),
    "twin-asset": (3379,),
    "twin": (1, 11, 290, 705, 822),
}
"""Cases that failed before what read them was mended, which are read first."""


@pytest.mark.parametrize("name", NAMES)
def test_mutated_files_end_in_an_answer_or_an_error_of_the_tree(name: str) -> None:
    run = fuzz_cases(TARGETS[name], [*FAILED_ONCE.get(name, ()), *range(count(name, CASES))])
    assert not run.failures, run.report()


def test_targets_that_failed_once_are_still_there() -> None:
    assert FAILED_ONCE.keys() <= TARGETS.keys()


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_ten_thousand_mutations_of_each_format(name: str) -> None:
    run = fuzz(TARGETS[name], count(name, SLOW_CASES), first=CASES)
    assert not run.failures, run.report()


@pytest.mark.slow
@pytest.mark.shared_data
@pytest.mark.parametrize("name", [name for name, target in TARGETS.items() if target.shared])
def test_mutations_of_real_files(name: str, shared_data: Path) -> None:
    run = fuzz(TARGETS[name], count(name, SHARED_CASES), shared=shared_data)
    assert not run.failures, run.report()
