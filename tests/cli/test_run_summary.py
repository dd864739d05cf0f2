"""The end of a build: what each of several grippers holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from manitwin.cli.run_summary import other_gripper_lines
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import RECORD, parse_record
from twin_folders import write_accepted


def record(root: Path, number: int, others: dict[str, dict[str, Any]]) -> TwinRecord:
    """Return a twin's record with outcomes of other grippers: tried and verified, or the reason for none."""
    document = json.loads((root / twin_name(write_accepted(root, number)) / RECORD).read_bytes())
    first = document["grasps"] | {"other_grippers": {}}
    document["grasps"]["other_grippers"] = {
        name: {"reason": told.get("reason"), "detail": None, "transferable": 0, "transferred": 0}
        | {"summary": None if "reason" in told else first | told}
        for name, told in others.items()
    }
    return parse_record(json.dumps(document).encode(), RECORD)


def test_other_grippers_are_told_of_with_the_twins_that_they_cannot_hold(tmp_path: Path) -> None:
    records = [
        record(tmp_path, 0, {"cup": {"reason": "no_proposal"}, "hand": {"simulated": 100, "verified": 40}}),
        record(tmp_path, 1, {"cup": {"simulated": 50, "verified": 50}, "hand": {"simulated": 100, "verified": 20}}),
        record(tmp_path, 2, {"cup": {"reason": "none_held"}, "tiny": {"reason": "too_wide"}}),
    ]
    assert other_gripper_lines(records) == [
        "with cup: 50 of 50 verified (100.0 %); no grasps of 2 of 3 twins (1 no_proposal, 1 none_held)",
        "with hand: 60 of 200 verified (30.0 %)",
        "with tiny: nothing to try; no grasps of 1 of 1 twins (1 too_wide)",
    ]


def test_one_gripper_alone_needs_no_further_line(tmp_path: Path) -> None:
    assert other_gripper_lines([record(tmp_path, 0, {})]) == []
