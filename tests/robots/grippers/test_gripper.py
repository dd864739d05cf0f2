"""The shipped grippers: their pads against themselves and published figures, the Panda against its public URDF."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.errors import UsageError
from manitwin.geometry.poses import inverse, transform
from manitwin.robots import grippers
from manitwin.robots.grippers.gripper import load_gripper, shipped_grippers

# Boxes of the left finger in panda_v2_gripper.urdf: centre, half extents (m), rotation about X; the finger frame lies
# 0.0584 m above panda_hand, and the finger moves along +Y.
URDF_FINGER = [
    ((0, 18.5e-3, 11e-3), (11e-3, 7.5e-3, 10e-3), 0.0),
    ((0, 6.8e-3, 2.2e-3), (11e-3, 4.4e-3, 1.9e-3), 0.0),
    ((0, 15.9e-3, 28.35e-3), (8.75e-3, 3.5e-3, 11.75e-3), np.pi / 6),
    ((0, 7.58e-3, 45.25e-3), (8.75e-3, 7.6e-3, 9.25e-3), 0.0),
]
FINGER_HEIGHT_M = 0.0584
# The grasp frame closes along X, panda_hand along Y: a quarter turn about Z, either way.
PANDA_HAND_TO_GRIPPER = transform(Rotation.from_euler("z", -90, degrees=True).as_matrix())


def corners(box_to_frame: np.ndarray, half_extents_m: np.ndarray) -> np.ndarray:
    signs = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), -1).reshape(-1, 3)
    points = signs * half_extents_m @ box_to_frame[:3, :3].T + box_to_frame[:3, 3]
    return points[np.lexsort(points.round(7).T)]


@pytest.mark.parametrize("opening_m", [0.0, 0.05, 0.08])
def test_panda_fingers_are_the_boxes_of_its_urdf(opening_m: float) -> None:
    panda = load_gripper("panda")
    ours = panda.boxes(opening_m)[len(panda.palm_boxes) :]
    expected = []
    for side in (1, -1):
        for center, half, angle in URDF_FINGER:
            box = transform(
                Rotation.from_euler("x", side * angle).as_matrix(),
                np.array([center[0], side * (center[1] + opening_m / 2), center[2] + FINGER_HEIGHT_M]),
            )
            expected.append((PANDA_HAND_TO_GRIPPER @ box, np.array(half)))
    for (ours_pose, ours_half), (pose, half) in zip(ours, expected, strict=True):
        assert corners(ours_pose, ours_half) == pytest.approx(corners(pose, half), abs=1e-9)


PARALLEL = ("panda", "robotiq_2f85", "wsg50_110")


def pad_box(gripper: Any, opening_m: float, side: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """The least and greatest corner of the finger's box that is nearest to the middle plane at the tips' depth."""
    count = len(gripper.finger_boxes)
    first = len(gripper.palm_boxes) + (0 if side == 1 else count)
    bounds = []
    for placed, half in gripper.boxes(opening_m)[first : first + count]:
        points = corners(placed, half)
        low, high = points.min(0), points.max(0)
        if low[2] <= gripper.tip_depth_m <= high[2]:
            bounds.append((low, high))
    return min(bounds, key=lambda box: min(abs(box[0][0]), abs(box[1][0])))


@pytest.mark.parametrize("name", PARALLEL)
def test_pads_touch_when_closed_and_are_a_stroke_apart_when_open(name: str) -> None:
    gripper = load_gripper(name)
    for opening_m in (0.0, gripper.opening_m):
        plus, minus = pad_box(gripper, opening_m)[0][0], pad_box(gripper, opening_m, -1)[1][0]
        assert plus - minus == pytest.approx(opening_m, abs=1e-4)
        assert plus == pytest.approx(-minus, abs=1e-9)


@pytest.mark.parametrize("name", PARALLEL)
def test_pad_extents_are_those_of_the_box_that_touches(name: str) -> None:
    gripper = load_gripper(name)
    low, high = pad_box(gripper, 0.0)
    half_y, half_z = gripper.pad_half_extents_m
    assert (low[1], high[1]) == pytest.approx((-half_y, half_y), abs=1e-4)
    end = gripper.tip_depth_m + half_z
    assert end == pytest.approx(high[2], abs=3e-4), "the pad ends with the finger"
    assert gripper.tip_depth_m - half_z >= low[2] - 3e-4, "and does not begin before its box"


@pytest.mark.parametrize("name", PARALLEL)
def test_nothing_but_the_pads_is_between_the_open_pads(name: str) -> None:
    gripper = load_gripper(name)
    low_z = gripper.tip_depth_m - gripper.pad_half_extents_m[1]
    for placed, half in gripper.boxes(gripper.opening_m):
        points = corners(placed, half)
        low, high = points.min(0), points.max(0)
        between = low[0] < gripper.opening_m / 2 - 1e-4 and high[0] > -gripper.opening_m / 2 + 1e-4
        assert not (between and high[2] > low_z + 3e-4)


@pytest.mark.parametrize(
    ("name", "stroke_m", "force_n"),
    [("panda", 0.080, (30, 70)), ("robotiq_2f85", 0.085, (20, 235)), ("wsg50_110", 0.110, (5, 80))],
)
def test_stroke_and_force_are_those_of_the_data_sheet(name: str, stroke_m: float, force_n: tuple[float, float]) -> None:
    gripper = load_gripper(name)
    assert gripper.opening_m == stroke_m
    assert force_n[0] <= gripper.force_n <= force_n[1]


def test_every_shipped_gripper_loads_by_its_name_and_names_its_sources() -> None:
    names = shipped_grippers()
    assert set(PARALLEL) <= set(names)
    for name in names:
        gripper = load_gripper(name)
        assert gripper.name == name
        assert len(gripper.source) > 20
        assert len(gripper.sha256) == 64
    assert len({load_gripper(name).sha256 for name in names}) == len(names)


def test_gripper_file_of_ones_own_is_loaded_by_its_path(tmp_path: Path) -> None:
    text = Path(grippers.__file__).parent.joinpath("definitions", "panda.toml").read_text()
    file = tmp_path / "mine.toml"
    file.write_text(text.replace('name = "panda"', 'name = "mine"').replace("opening_m = 0.080", "opening_m = 0.070"))
    mine = load_gripper(str(file))
    assert (mine.name, mine.opening_m) == ("mine", 0.07)
    assert mine.sha256 != load_gripper("panda").sha256


def test_second_finger_is_the_half_turn_of_the_first() -> None:
    panda = load_gripper("panda")
    half_turn = transform(np.diag([-1.0, -1.0, 1.0]))
    fingers = panda.boxes(0.06)[len(panda.palm_boxes) :]
    count = len(panda.finger_boxes)
    for (first, half), (second, other) in zip(fingers[:count], fingers[count:], strict=True):
        assert corners(half_turn @ first, half) == pytest.approx(corners(second, other), abs=1e-9)
    assert inverse(half_turn) == pytest.approx(half_turn)


def test_unknown_gripper_is_named_with_the_nearest_and_all_that_are_shipped() -> None:
    with pytest.raises(UsageError, match="did you mean 'panda'") as error:
        load_gripper("pandaa")
    assert all(name in str(error.value) for name in shipped_grippers())


def test_gripper_file_that_is_not_there_is_named() -> None:
    with pytest.raises(UsageError, match=r"nowhere\.toml") as error:
        load_gripper("nowhere.toml")
    assert "panda" in str(error.value)
