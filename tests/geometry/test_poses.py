"""Rotation angles against SciPy's, near zero and near half a turn too."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import rotation_angle_rad


@pytest.mark.parametrize("angle_rad", [0.0, 1e-6, 0.3, 2.0, 3.1, np.pi])
def test_rotation_angle_is_that_of_the_rotation_vector(angle_rad: float) -> None:
    axis = np.array([0.6, -0.48, 0.64])
    rotation = Rotation.from_rotvec(angle_rad * axis).as_matrix()
    assert rotation_angle_rad(rotation) == pytest.approx(angle_rad, rel=1e-6, abs=1e-9)
