"""Rotation angles against SciPy's, near zero and near half a turn too; the signs of quaternions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import rotation_angle_rad, without_sign_changes


@pytest.mark.parametrize("angle_rad", [0.0, 1e-6, 0.3, 2.0, 3.1, np.pi])
def test_rotation_angle_is_that_of_the_rotation_vector(angle_rad: float) -> None:
    axis = np.array([0.6, -0.48, 0.64])
    rotation = Rotation.from_rotvec(angle_rad * axis).as_matrix()
    assert rotation_angle_rad(rotation) == pytest.approx(angle_rad, rel=1e-6, abs=1e-9)


def test_quaternions_of_a_turning_thing_never_change_their_sign() -> None:
    turns_rad = np.linspace(0.5, 6.0, 12)
    smooth = np.column_stack([np.cos(turns_rad / 2), np.zeros((12, 2)), np.sin(turns_rad / 2)])
    signs = np.array([1, -1, -1, 1, -1, 1, 1, 1, -1, -1, 1, -1])[:, None]
    np.testing.assert_array_equal(without_sign_changes(smooth * signs), smooth)
    np.testing.assert_array_equal(without_sign_changes(-smooth * signs), smooth, "the first one has w >= 0")
    np.testing.assert_array_equal(without_sign_changes(smooth[1:] * signs[1:], -smooth[0]), -smooth[1:])


def test_first_sign_of_a_hand_that_looks_down_is_no_matter_of_noise() -> None:
    down = np.array([[2e-6, -0.7077, 0.7066, 1e-5], [-2e-6, -0.7077, 0.7066, 1e-5]])
    for first in (*down, *-down):
        chosen = without_sign_changes(first[None])
        assert chosen[0, 1] == pytest.approx(0.7077)
