from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.assets.writers.mass_properties import principal_axes


def rebuilt(moments: np.ndarray, wxyz: np.ndarray) -> np.ndarray:
    turn = Rotation.from_quat(wxyz, scalar_first=True).as_matrix()
    return turn @ np.diag(moments) @ turn.T


@pytest.mark.parametrize("seed", range(50))
def test_moments_are_the_eigenvalues_and_the_tensor_comes_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(20, 3)) * 10.0 ** rng.uniform(-3, 0, 3)
    tensor = np.trace(points.T @ points) * np.eye(3) - points.T @ points
    moments, wxyz = principal_axes(tensor)
    np.testing.assert_allclose(np.sort(moments), np.linalg.eigvalsh(tensor), rtol=1e-12, atol=1e-15 * tensor.max())
    np.testing.assert_allclose(rebuilt(moments, wxyz), tensor, rtol=0, atol=1e-14 * np.abs(tensor).max())


def test_diagonal_tensor_keeps_its_axes_and_order() -> None:
    moments, wxyz = principal_axes(np.diag([5e-4, 1e-4, 3e-4]))
    assert moments.tolist() == [5e-4, 1e-4, 3e-4] and wxyz.tolist() == [1, 0, 0, 0]


def test_round_things_stay_unturned() -> None:
    _, wxyz = principal_axes(np.diag([2e-4, 2e-4, 1e-4]) + 1e-21)
    np.testing.assert_allclose(wxyz, [1, 0, 0, 0], atol=1e-9)
