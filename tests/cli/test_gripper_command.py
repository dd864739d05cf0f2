"""``manitwin gripper``: what it says of a file, and that the picture has the gripper where the file has it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from manitwin.cli.commands.gripper import gripper
from manitwin.cli.main import app
from manitwin.errors import UsageError
from small_hand import TOML, write_hand


def said(capsys: pytest.CaptureFixture[str]) -> str:
    return " ".join(capsys.readouterr().out.split())


def test_jaws_are_told_by_their_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    gripper("panda")
    assert "holds objects of up to 80 mm with 50 N, friction 1; its tips are 103 mm in front of its base" in said(
        capsys
    )


def test_hand_is_told_with_what_its_links_have(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gripper(write_hand(tmp_path))
    text = said(capsys)
    assert "6 joints: thumb_1, thumb_2, index_1" in text
    assert (
        "opening 60 mm: 60 mm along X between the tips, which reach depth 98; thumb at x -36, z 80, fingers at x 36, z 80"
        in text
    )
    assert "note" not in text


def test_hand_whose_fingers_oppose_aslant_is_noted_with_the_turn_that_mends_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    level, half = "quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]", 0.5 * np.deg2rad(30)
    aslant = f"quaternion_wxyz = [{np.cos(half)!r}, 0.0, {np.sin(half)!r}, 0.0]".replace("np.float64(", "").replace(
        ")", ""
    )
    gripper(
        write_hand(tmp_path, TOML.replace(level, aslant).replace("depth_m = [0.06, 0.085]", "depth_m = [0.05, 0.06]"))
    )
    assert "30 degrees off X, the closing direction; turn root_to_gripper by -0.52 rad about Y" in said(capsys)


def test_picture_shows_thumb_left_and_fingers_right(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gripper(write_hand(tmp_path), draw=tmp_path / "hand.png")
    assert "hand.png" in said(capsys).replace(" ", "")
    picture = np.asarray(Image.open(tmp_path / "hand.png").convert("RGB")).astype(int)
    assert picture.shape[1] == 3 * 420
    view = picture[34:180, :420]  # the open hand above the arrows, X to the right
    red = np.argwhere((view[..., 0] - view[..., 2] > 60) & (view[..., 1] > 40) & (view[..., 1] < 110))
    blue = np.argwhere((view[..., 2] - view[..., 0] > 60) & (view[..., 1] > 100))
    assert red[:, 1].max() < 210 < blue[:, 1].min()


@pytest.mark.parametrize("name", ["panda", "suction"])
def test_jaws_and_cups_are_drawn(tmp_path: Path, name: str) -> None:
    gripper(name, draw=tmp_path / "a.png")
    assert len(np.unique(np.asarray(Image.open(tmp_path / "a.png")))) > 20


def test_hand_whose_fingers_are_elsewhere_than_its_file_says_is_drawn_and_refused(tmp_path: Path) -> None:
    turned = TOML.replace("quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]", "quaternion_wxyz = [0.0, 0.0, 0.0, 1.0]")
    with pytest.raises(UsageError, match="the thumb belongs on -X"):
        gripper(write_hand(tmp_path, turned), draw=tmp_path / "hand.png")
    view = np.asarray(Image.open(tmp_path / "hand.png").convert("RGB")).astype(int)[34:180, :420]
    red = np.argwhere((view[..., 0] - view[..., 2] > 60) & (view[..., 1] > 40) & (view[..., 1] < 110))
    assert red[:, 1].min() > 210, "the thumb is seen on the wrong side"


def test_picture_of_another_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"ends in \.png"):
        gripper("panda", draw=tmp_path / "a.jpg")


def test_file_that_is_wrong_ends_with_one_line(tmp_path: Path) -> None:
    file = write_hand(tmp_path, TOML.replace("force_n = 8.0", "force_n = -8.0"))
    done = CliRunner().invoke(app, ["gripper", file])
    assert done.exit_code == 2 or isinstance(done.exception, UsageError)
    assert not isinstance(done.exception, (TypeError, ValueError))
