"""Principal moments of inertia and their axes, for formats that take no full tensor."""

from __future__ import annotations

import math

import numpy as np

from manitwin.geometry.poses import quaternion_wxyz

_SWEEPS = 30  # it converges quadratically: four or five are what any tensor needs


def principal_axes(inertia_kg_m2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the moments ``(3,)`` kg m^2 and the quaternion wxyz ``(4,)`` that turns principal axes into the object's.

    ``inertia = R diag(moments) R^T`` with ``R`` the quaternion's rotation. A tensor that is diagonal keeps its axes, and
    the result is the same on every machine: LAPACK's would turn freely where two moments are equal.
    Source: cyclic Jacobi rotations (Golub and Van Loan, Matrix Computations, section 8.5.3).
    """
    tensor = np.array(inertia_kg_m2, dtype=np.float64)
    axes = np.eye(3)
    for _ in range(_SWEEPS):
        rotated = [_zero_element(tensor, axes, p, q) for p, q in ((0, 1), (0, 2), (1, 2))]
        if not any(rotated):
            break
    return np.diag(tensor).copy(), quaternion_wxyz(axes)


def _zero_element(tensor: np.ndarray, axes: np.ndarray, p: int, q: int) -> bool:
    """Rotate in the plane of axes p and q so that their product of inertia is zero; False where it is nothing already."""
    off = float(tensor[p, q])
    if abs(off) <= 1e-16 * math.sqrt(abs(float(tensor[p, p] * tensor[q, q]))):
        tensor[p, q] = tensor[q, p] = 0.0
        return False
    ratio = float(tensor[q, q] - tensor[p, p]) / (2 * off)
    tangent = math.copysign(1.0, ratio) / (abs(ratio) + math.hypot(ratio, 1.0))  # the smaller of both angles
    cosine = 1 / math.hypot(tangent, 1.0)
    turn = np.eye(3)
    turn[p, p] = turn[q, q] = cosine
    turn[p, q], turn[q, p] = cosine * tangent, -cosine * tangent
    tensor[:] = turn.T @ tensor @ turn
    axes[:] = axes @ turn
    return True
