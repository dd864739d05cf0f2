"""Files of jaws and cups of one's own: numbers that cannot be, and boxes that are not where the numbers say."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.robots.grippers.gripper import load_gripper

JAWS = """kind = "parallel"
name = "mine"
source = "made for a test"
opening_m = 0.070
tip_depth_m = 0.110
force_n = 30.0
finger_friction = 0.8
pad_half_extents_m = [0.006, 0.010]

[[finger_boxes]]
center_m = [0.004, 0.0, 0.095]
half_extents_m = [0.004, 0.006, 0.025]

[[palm_boxes]]
center_m = [0.0, 0.0, 0.035]
half_extents_m = [0.050, 0.020, 0.035]
"""
CUP = """kind = "suction"
name = "cup"
source = "made for a test"
lip_radius_m = 0.030
lip_travel_m = 0.003
reach_m = 0.005
max_tilt_rad = 0.1
ceiling_m = 0.004
max_surface_angle_rad = 0.3
vacuum_pa = 60000.0
tip_depth_m = 0.08
finger_friction = 0.5

[[body_boxes]]
center_m = [0.0, 0.0, 0.035]
half_extents_m = [0.02, 0.02, 0.035]
"""


def refusal(folder: Path, text: str) -> str:
    file = folder / "mine.toml"
    file.write_text(text)
    with pytest.raises(UsageError) as error:
        load_gripper(str(file))
    assert str(error.value).startswith(f"gripper file {file}: ")
    return str(error.value)


@pytest.mark.parametrize("text", [JAWS, CUP])
def test_right_files_load(tmp_path: Path, text: str) -> None:
    (tmp_path / "mine.toml").write_text(text)
    assert load_gripper(str(tmp_path / "mine.toml")).force_n > 0


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("opening_m = 0.070", "opening_m = 70", "opening_m: is 70, it must be above 0 and at most 1: give metres"),
        ("force_n = 30.0", "force_n = -30.0", "force_n: is -30, it must be above 0: give its size, without a sign"),
        ("finger_friction = 0.8", "finger_friction = 0", "finger_friction: is 0, it must be above 0"),
        ("[0.004, 0.006, 0.025]", "[0.004, -0.006, 0.025]", "finger_boxes.0.half_extents_m.1: is -0.006"),
        ("[0.0, 0.0, 0.035]", "[0.0, 0.0, 35]", "palm_boxes.0.center_m.2: is 35"),
        ("half_extents_m = [0.050", "rotation_y_rad = 30\nhalf_extents_m = [0.050", "give radians, not degrees"),
        ('name = "mine"', 'name = "../mine"', "name: is '../mine', it must be letters, digits"),
        ('source = "made for a test"', 'source = " "', "source: is empty"),
        ("force_n = 30.0", "", "it lacks force_n; give it"),
        ("force_n = 30.0", "force = 30.0", "force: not a key of this kind; these are missing: force_n"),
        ("tip_depth_m = 0.110", "tip_depth_m = 0.150", "outside the fingers: the finger_boxes reach from 0.07 to 0.12 along +Z"),
        ("[0.004, 0.0, 0.095]", "[0.0, 0.004, 0.095]", "inner face is at x = -0.004 at the tips' depth, it must be at 0"),
        ("[0.004, 0.0, 0.095]", "[0.039, 0.0, 0.095]", "inner face is at x = 0.035"),
        ("[0.006, 0.010]", "[0.006, 0.020]", "from 0.09 to 0.13 along Z, the boxes that have the inner face only from 0.07"),
        ("[0.006, 0.010]", "[0.010, 0.010]", "from -0.01 to 0.01 along Y"),
        ('name = "mine"', 'name = "panda"', "'panda' is the name of a shipped gripper"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_jaws_is_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in JAWS
    assert said in refusal(tmp_path, JAWS.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "60000.0",
            "60",
            "vacuum_pa: is 60, it must be above 101.325 and at most 101325, the atmosphere: give pascals",
        ),
        ("60000.0", "-60000", "vacuum_pa: is -60000"),
        (
            "max_tilt_rad = 0.1",
            "max_tilt_rad = 15",
            "max_tilt_rad: is 15, it must be at least 0 and at most 1.5708: give radians",
        ),
        ("lip_radius_m = 0.030", "lip_radius_m = 30", "lip_radius_m: is 30"),
        ("tip_depth_m = 0.08", "tip_depth_m = 0.05", "they reach to 0.07 along +Z, past the lip at tip_depth_m = 0.05"),
    ],
)
def test_what_is_wrong_with_a_cup_is_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in CUP
    assert said in refusal(tmp_path, CUP.replace(old, new))


@pytest.mark.parametrize("name", ["mine.urdf", "mine.xacro"])
def test_urdf_in_place_of_a_gripper_file_is_told_what_to_write(name: str) -> None:
    with pytest.raises(UsageError, match=r"description of a robot; write a \.toml file"):
        load_gripper(name)
