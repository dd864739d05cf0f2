"""Mass properties of a twin for export, validated so that they are possible for a rigid body."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.licenses import license_of
from manitwin.errors import ExportError
from manitwin.formats.markdown import one_line
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.twin.link_records import Link
from manitwin.twin.store import canonical_json

TRIANGLE_TOLERANCE = 1e-9
"""Largest shortfall in the triangle inequality of moments, relative to the largest moment: allows for rounding of thin plates."""
_SWEEPS = 30  # convergence is quadratic: four or five sweeps suffice for any tensor
PHYSICS_FILE = "physics.json"


@dataclass(frozen=True)
class TwinInertial:
    """Mass, ``center_of_mass_m (3,)`` and the inertia ``inertia_kg_m2 (3, 3)`` about it, in the axes of the object frame.

    ``principal_moments_kg_m2 (3,)`` and ``principal_axes_wxyz``, the rotation from the principal axes to the object frame,
    describe the same tensor.
    """

    mass_kg: float
    center_of_mass_m: np.ndarray
    inertia_kg_m2: np.ndarray
    principal_moments_kg_m2: np.ndarray
    principal_axes_wxyz: np.ndarray


def inertial_of(twin: TwinContent) -> TwinInertial:
    """Return the mass properties of a twin.

    Raises ExportError for a mass that is not positive, and for a tensor that is not symmetric, not positive definite, or
    violates the triangle inequality of moments: engines refuse such values or change them silently.
    """
    physical = twin.physical
    return _inertial(twin.name, physical.mass_kg.value, physical.center_of_mass_m, physical.inertia_kg_m2)


def inertial_of_link(twin: TwinContent, link: Link) -> TwinInertial:
    """Return the mass properties of one link, in the present pose of the twin; raises ExportError like ``inertial_of``."""
    return _inertial(f"{twin.name}, link {link.name}", link.mass_kg, link.center_of_mass_m, link.inertia_kg_m2)


def _inertial(name: str, mass_kg: float, center_of_mass_m: list[float], inertia: list[list[float]]) -> TwinInertial:
    tensor = np.array(inertia)
    if not mass_kg > 0:
        raise ExportError(f"{name}: its mass is {mass_kg} kg; build the twin again with a mass above zero")
    if not np.allclose(tensor, tensor.T, rtol=0, atol=1e-9 * np.abs(tensor).max()):
        raise ExportError(f"{name}: its inertia tensor is not symmetric; build the twin again")
    tensor = (tensor + tensor.T) / 2
    moments, axes_wxyz = principal_axes(tensor)
    least, middle, most = sorted(moments.tolist())
    slack = least + middle - most
    if not least > 0 or slack < -TRIANGLE_TOLERANCE * most:
        raise ExportError(
            f"{name}: no rigid body has the principal moments {', '.join(f'{m:.3g}' for m in moments)} kg m^2 "
            "(each is positive, and none exceeds the sum of the others); build the twin again"
        )
    if slack < TRIANGLE_TOLERANCE * most:  # MuJoCo tolerates no rounding in A + B >= C
        extra = TRIANGLE_TOLERANCE * most - slack
        tensor, moments = tensor + extra * np.eye(3), moments + extra
    return TwinInertial(mass_kg, np.array(center_of_mass_m), tensor, moments, axes_wxyz)


def principal_axes(inertia_kg_m2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the moments ``(3,)`` kg m^2 and the quaternion wxyz ``(4,)`` from the principal axes to the object frame.

    ``inertia = R diag(moments) R^T`` with ``R`` the rotation of the quaternion. A diagonal tensor keeps its axes, and the
    result is the same on every machine; LAPACK would choose arbitrary axes where two moments are equal.

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
    """Rotate in the plane of axes p and q to make their product of inertia zero; return False if it is negligible already."""
    off = float(tensor[p, q])
    if abs(off) <= 1e-16 * math.sqrt(abs(float(tensor[p, p] * tensor[q, q]))):
        tensor[p, q] = tensor[q, p] = 0.0
        return False
    ratio = float(tensor[q, q] - tensor[p, p]) / (2 * off)
    # the smaller of the two possible angles
    tangent = math.copysign(1.0, ratio) / (abs(ratio) + math.hypot(ratio, 1.0))
    cosine = 1 / math.hypot(tangent, 1.0)
    turn = np.eye(3)
    turn[p, p] = turn[q, q] = cosine
    turn[p, q], turn[q, p] = cosine * tangent, -cosine * tangent
    tensor[:] = turn.T @ tensor @ turn
    axes[:] = axes @ turn
    return True


def physics_of(twin: TwinContent) -> dict[str, Any]:
    """Return the physical properties as JSON values: SI units, object frame, each estimate with its interval and source.

    Raises ExportError like ``inertial_of``.
    """
    physical, inertial = twin.physical, inertial_of(twin)
    return {
        "name": twin.name,
        "twin_id": twin.record.twin_id,
        "revision": twin.record.revision,
        "license": license_of(twin.record),
        "attribution": one_line(twin.record.source.attribution or "") or None,
        "units": "metres, kilograms, seconds, radians",
        "frame": "right-handed, +Z up, origin at the bottom centre; quaternions wxyz",
        "material": physical.material,
        **{
            key: getattr(physical, key).model_dump(mode="json")
            for key in ("mass_kg", "friction_static", "friction_dynamic", "restitution")
        },
        "density_kg_m3": physical.density_kg_m3,
        "extents_m": list(physical.extents_m),
        "center_of_mass_m": inertial.center_of_mass_m.tolist(),
        "center_of_mass_uncertainty_m": physical.center_of_mass_uncertainty_m,
        "inertia_kg_m2": inertial.inertia_kg_m2.tolist(),
        "principal_moments_kg_m2": inertial.principal_moments_kg_m2.tolist(),
        "principal_axes_quaternion_wxyz": inertial.principal_axes_wxyz.tolist(),
        "mass_distribution": physical.mass_distribution,
        "filling": None if physical.filling is None else physical.filling.model_dump(mode="json"),
        **_moving(twin),
    }


def _moving(twin: TwinContent) -> dict[str, Any]:
    """Return links and joints as in twin.json; an empty dict for a rigid twin."""
    record = twin.record
    if not record.links:
        return {}
    links = [link.model_dump(mode="json", exclude={"hulls", "faces"}) for link in record.links]
    return {"links": links, "joints": [joint.model_dump(mode="json") for joint in record.joints]}


def physics_file(twin: TwinContent) -> bytes:
    """Return physics.json. Raises ExportError like ``inertial_of``."""
    return canonical_json(physics_of(twin)).encode()
