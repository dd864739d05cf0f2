"""The mass properties of a twin as every format takes them, refused where no rigid body can have them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.assets.writers.content import TwinContent
from manitwin.assets.writers.principal_axes import principal_axes
from manitwin.errors import ExportError

TRIANGLE_TOLERANCE = 1e-9
"""By how much, of the largest moment, the other two may fall short of it: rounding of thin plates, no more."""


@dataclass(frozen=True)
class Inertial:
    """Mass, ``center_of_mass_m (3,)`` and ``inertia_kg_m2 (3, 3)`` about it along the axes of the object frame.

    The same tensor as ``principal_moments_kg_m2 (3,)`` along axes that ``principal_axes_wxyz`` turns into the object's.
    """

    mass_kg: float
    center_of_mass_m: np.ndarray
    inertia_kg_m2: np.ndarray
    principal_moments_kg_m2: np.ndarray
    principal_axes_wxyz: np.ndarray


def inertial_of(twin: TwinContent) -> Inertial:
    """Return a twin's mass properties.

    Raises ExportError for a mass that is not positive, and for a tensor that is not symmetric, not positive definite or
    against the triangle inequality of moments, which engines refuse or change in silence.
    """
    physical = twin.physical
    mass_kg, tensor = physical.mass_kg.value, np.array(physical.inertia_kg_m2)
    if not mass_kg > 0:
        raise ExportError(f"{twin.name}: its mass is {mass_kg} kg; build the twin again with a mass above zero")
    if not np.allclose(tensor, tensor.T, rtol=0, atol=1e-9 * np.abs(tensor).max()):
        raise ExportError(f"{twin.name}: its inertia tensor is not symmetric; build the twin again")
    tensor = (tensor + tensor.T) / 2
    moments, axes_wxyz = principal_axes(tensor)
    least, middle, most = sorted(moments.tolist())
    slack = least + middle - most
    if not least > 0 or slack < -TRIANGLE_TOLERANCE * most:
        raise ExportError(
            f"{twin.name}: no rigid body has the principal moments {', '.join(f'{m:.3g}' for m in moments)} kg m^2 "
            "(each is positive, and none exceeds the sum of the others); build the twin again"
        )
    if slack < TRIANGLE_TOLERANCE * most:  # MuJoCo allows for no rounding of A + B >= C
        extra = TRIANGLE_TOLERANCE * most - slack
        tensor, moments = tensor + extra * np.eye(3), moments + extra
    return Inertial(mass_kg, np.array(physical.center_of_mass_m), tensor, moments, axes_wxyz)
