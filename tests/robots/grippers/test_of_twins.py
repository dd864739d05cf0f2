"""The gripper of a twin's grasps, by its name and digest."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.twin_grippers import find_gripper, is_different_gripper, require_same_gripper
from small_hand import write_hand


def test_shipped_gripper_needs_no_file() -> None:
    assert find_gripper("panda", load_gripper("panda").sha256).name == "panda"


def test_own_gripper_is_taken_from_those_given_if_it_is_the_twins(tmp_path: Path) -> None:
    hand = load_gripper(write_hand(tmp_path))
    assert find_gripper("small_hand", hand.sha256, [hand]) is hand
    with pytest.raises(UsageError, match="the given file differs from the one of the twin's grasps"):
        find_gripper("small_hand", "0" * 64, [hand])
    with pytest.raises(
        UsageError, match=r"gripper other is not shipped with the package.*given are small_hand; give its file"
    ):
        find_gripper("other", hand.sha256, [hand])
    with pytest.raises(UsageError, match="a twin stores only its name; give its file with --gripper"):
        find_gripper("small_hand", hand.sha256)


def test_another_gripper_of_the_same_name_is_told_by_its_digest(tmp_path: Path) -> None:
    hand = load_gripper(write_hand(tmp_path))
    assert not is_different_gripper(hand, {"small_hand": hand.sha256}) and not is_different_gripper(
        hand, {"panda": "0" * 64}
    )
    assert is_different_gripper(hand, {"panda": "1" * 64, "small_hand": "0" * 64})
    twins = [
        ("first", {"small_hand": hand.sha256}),
        ("second", {"small_hand": "0" * 64}),
        ("third", {"small_hand": "1" * 64}),
    ]
    require_same_gripper(hand, twins[:1], "my_arm")
    with pytest.raises(
        UsageError,
        match=r"twin second \(and 1 more of 3\) has grasps of a gripper small_hand .* the small_hand of my_arm; build",
    ):
        require_same_gripper(hand, twins, "my_arm")


def test_shipped_gripper_of_an_earlier_version_goes_on() -> None:
    shipped, earlier = load_gripper("panda"), {"panda": "0" * 64}
    assert shipped.sha256 != earlier["panda"] and not is_different_gripper(shipped, earlier)
    require_same_gripper(shipped, [("first", earlier)])
