import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import quaternion_wxyz
from manitwin.twin.record import Placement
from manitwin.twin.resting import UPRIGHT_DEG, classify_rest, resting_poses, side_down, tilt_deg


def turned(axis: str, degrees: float) -> np.ndarray:
    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()


@pytest.mark.parametrize(
    ("axis", "degrees", "rest"),
    [
        ("z", 135, "upright"),
        ("x", UPRIGHT_DEG - 0.1, "upright"),
        ("x", UPRIGHT_DEG + 0.1, "lying"),
        ("y", 90, "lying"),
        ("x", 180 - UPRIGHT_DEG - 0.1, "lying"),
        ("x", 180 - UPRIGHT_DEG + 0.1, "upside_down"),
        ("y", 180, "upside_down"),
    ],
)
def test_a_rest_is_told_by_where_up_points(axis: str, degrees: float, rest: str) -> None:
    assert classify_rest(turned(axis, degrees)) == rest
    assert classify_rest(turned("z", 77) @ turned(axis, degrees)) == rest, "the heading says nothing of it"
    assert tilt_deg(turned(axis, degrees)) == pytest.approx(0 if axis == "z" else degrees)


@pytest.mark.parametrize("side", ["+x", "-x", "+y", "-y"])
def test_a_lying_object_lies_on_the_side_whose_points_come_lowest(side: str) -> None:
    point = np.array([side[1] == "x", side[1] == "y", False], float) * (1 if side[0] == "+" else -1)
    turns = [turned(axis, degrees) for axis in "xy" for degrees in (90, -90)]
    down = [turn for turn in turns if (turn @ point)[2] < -0.99]
    assert [side_down(turn) for turn in down] == [side]


def test_poses_that_stayed_come_first_and_likely_ones_before_unlikely_with_their_numbers() -> None:
    def placement(axis: str, degrees: float, probability: float, settled: bool) -> Placement:
        rotation = turned(axis, degrees)
        return Placement(
            position_m=(0.0, 0.0, 0.0), quaternion_wxyz=tuple(quaternion_wxyz(rotation)), probability=probability,
            upright=bool(rotation[2, 2] > 0.99), settled=settled, collision_radius_m=0.05,
        )  # fmt: skip

    poses = resting_poses(
        [placement("z", 30, 0.3, False), placement("x", 180, 0.1, True), placement("y", 90, 0.2, True)]
    )
    assert [(pose.number, pose.rest, pose.side_down) for pose in poses] == [
        (2, "lying", "+x"), (1, "upside_down", None), (0, "upright", None),
    ]  # fmt: skip
    assert [pose.tilt_deg for pose in poses] == pytest.approx([90, 180, 0])
    assert [pose.placement.probability for pose in poses] == [0.2, 0.1, 0.3]
