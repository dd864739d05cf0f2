"""What the end of a text's item says of what the text was taken as."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from manitwin.pipeline.recipe import ending_of
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.store import RECORD, read_record, write_twin_record
from twin_folders import write_accepted


@pytest.mark.parametrize(
    ("prompt", "model", "end"),
    [
        ("king", "template:chess king", "grasps verified; taken as a chess king"),
        ("A white  Chess King", "template:chess king", "grasps verified"),
        ("a tin opener", "template:can opener, filled in by a model", "grasps verified; taken as a can opener"),
        ("king", "another/model", "grasps verified"),
    ],
)
def test_text_that_does_not_name_its_template_is_told_what_it_was_taken_as(
    tmp_path: Path, prompt: str, model: str, end: str
) -> None:
    folder = tmp_path / twin_name(write_accepted(tmp_path, 1))
    record = json.loads((folder / RECORD).read_bytes())
    record["source"] |= {"kind": "text", "prompt": prompt}
    stages = record["provenance"]["stages"]
    stages["generate"] = {**next(iter(stages.values())), "backend": "lift", "model": model}
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    assert ending_of(read_record(folder)).detail.endswith(end)


def test_mesh_is_taken_as_nothing(tmp_path: Path) -> None:
    assert "taken as" not in ending_of(read_record(tmp_path / twin_name(write_accepted(tmp_path, 1)))).detail
