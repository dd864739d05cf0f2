import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.geometry.resting import UPRIGHT_DEG, rest_of, side_down, tilt_deg


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
    assert rest_of(turned(axis, degrees)) == rest
    assert rest_of(turned("z", 77) @ turned(axis, degrees)) == rest, "the heading says nothing of it"
    assert tilt_deg(turned(axis, degrees)) == pytest.approx(0 if axis == "z" else degrees)


@pytest.mark.parametrize("side", ["+x", "-x", "+y", "-y"])
def test_a_lying_object_lies_on_the_side_whose_points_come_lowest(side: str) -> None:
    point = np.array([side[1] == "x", side[1] == "y", False], float) * (1 if side[0] == "+" else -1)
    turns = [turned(axis, degrees) for axis in "xy" for degrees in (90, -90)]
    down = [turn for turn in turns if (turn @ point)[2] < -0.99]
    assert [side_down(turn) for turn in down] == [side]
