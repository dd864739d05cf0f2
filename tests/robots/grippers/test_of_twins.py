"""The gripper of a twin's grasps, by its name and digest."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.of_twins import gripper_of
from small_hand import write_hand


def test_shipped_gripper_needs_no_file() -> None:
    assert gripper_of("panda", load_gripper("panda").sha256).name == "panda"


def test_own_gripper_is_taken_from_those_given_if_it_is_the_twins(tmp_path: Path) -> None:
    hand = load_gripper(write_hand(tmp_path))
    assert gripper_of("small_hand", hand.sha256, [hand]) is hand
    with pytest.raises(UsageError, match="the file that is given is another than that of the twin's grasps"):
        gripper_of("small_hand", "0" * 64, [hand])
    with pytest.raises(
        UsageError, match=r"gripper other does not come with the package.*given are small_hand; give its file"
    ):
        gripper_of("other", hand.sha256, [hand])
    with pytest.raises(UsageError, match="a twin has only its name; give its file with --gripper"):
        gripper_of("small_hand", hand.sha256)
