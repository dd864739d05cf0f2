"""physics.json: what a twin says of its physics, whole, for what a format cannot say."""

from __future__ import annotations

from typing import Any

from manitwin.assets.writers.content import TwinContent
from manitwin.assets.writers.inertial import inertial_of
from manitwin.assets.writers.licenses import license_of
from manitwin.formats.markdown import one_line
from manitwin.twin.store import canonical_json

PHYSICS_FILE = "physics.json"


def physics_of(twin: TwinContent) -> dict[str, Any]:
    """Return the physical properties as JSON values: SI units, object frame, each estimate with its interval and source.

    Raises ExportError as ``inertial_of``.
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
    }


def physics_file(twin: TwinContent) -> bytes:
    """Return physics.json. Raises ExportError as ``inertial_of``."""
    return canonical_json(physics_of(twin)).encode()
