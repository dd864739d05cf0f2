"""The harness sees what it is there for: exceptions, hangs, crashes, memory and files outside of the folder."""

from __future__ import annotations

from random import Random

import fuzz_broken_readers
import pytest
from fuzz_harness import fuzz
from fuzz_mutations import mutated
from fuzz_target import TARGETS

SAMPLES = {
    "a.json": b'{"a": [1, 2.5, {"b": "c"}], "d": null}',
    "a.xml": b'<?xml version="1.0"?><a b="1"><c d="2 3">text</c></a>',
    "a.glb": b"glTF\x02\0\0\0\x28\0\0\0\x14\0\0\0JSON" + b'{"asset":{"v":"2"}}' + b" ",
    "a.csv": b"file,name\na.glb,mug\n",
    "a.bin": bytes(range(100)),
}


@pytest.mark.parametrize("name", SAMPLES)
def test_one_seed_makes_one_file_and_others_make_others(name: str) -> None:
    made = [mutated(name, SAMPLES[name], (), Random(seed)) for seed in range(60)]
    assert made == [mutated(name, SAMPLES[name], (), Random(seed)) for seed in range(60)]
    assert len(set(made)) > 40


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("broken-raises", "exception"),
        ("broken-exits", "exception"),
        ("broken-crashes", "the process ended with status -11"),
        ("broken-hangs", "too much processor time"),
        ("broken-waits", "no answer"),
        ("broken-hoards", "exception"),
        ("broken-looks", "opened"),
        ("broken-lines", "message"),
    ],
)
def test_a_broken_reader_is_found_with_the_case_that_shows_it(name: str, kind: str) -> None:
    run = fuzz(fuzz_broken_readers.BROKEN[name], 1, cpu_s=1)
    assert {failure.kind for failure in run.failures} == {kind}
    assert f"fuzz_run.py {name} --seed {run.failures[0].case}" in run.report()
    assert name not in TARGETS
