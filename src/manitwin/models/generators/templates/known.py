"""What a template knows of the thing that it made, as an import record: name, mass properties, material and points."""

from __future__ import annotations

import numpy as np
import trimesh
from manifold3d import Manifold

from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.models.generators.templates.made import Made
from manitwin.models.generators.templates.template import IN_THE_OPEN, KnownPoint
from manitwin.twin.import_record import GivenPoint, ImportRecord

MOST_POINTS = 4
"""As many functional points as an object has (paper)."""


def known_of(made: Made, text: str) -> ImportRecord:
    """Return the record of a thing, in its object frame.

    The mass is that of its parts' volumes and densities, of whatever is closed in with its contents; centre and inertia are
    summed over the parts (parallel axis theorem).
    """
    mass_kg, center, inertia = mass_properties(made.solids)
    heaviest = max(made.masses_kg, key=lambda part: made.masses_kg[part])
    return ImportRecord(
        format="template",
        file=text,
        name=made.category,
        category=made.category,
        license=None,
        attribution=None,
        asset_to_object=np.eye(4).tolist(),
        mass_kg=mass_kg,
        center_of_mass_m=center.tolist(),
        inertia_kg_m2=inertia.tolist(),
        friction_static=None,
        friction_dynamic=None,
        restitution=None,
        material=made.looks[heaviest].material,
        captions=[],
        functional_points=[
            GivenPoint(position_m=_on_surface(made, point).tolist(), normal=list(point.direction), label=point.label)
            for point in made.points[:MOST_POINTS]
        ],
        grasp_points=[],
        grasps=[],
        rests=[],
        missing=["friction", "restitution", "grasps"],
        remarks=[],
    )


def _on_surface(made: Made, point: KnownPoint) -> np.ndarray:
    """Return a point's place; of an opening, hole or axis, which are in the open, the nearest place of its part, towards -Y."""
    position = np.array(point.position_m)
    if point.kind not in IN_THE_OPEN:
        return position
    centers = made.mesh.vertices[made.mesh.faces[made.mesh.faces_of(point.part)]].mean(axis=1)
    away = np.linalg.norm(centers - position, axis=1)
    return np.asarray(centers[np.lexsort((centers[:, 1], np.round(away, 3)))[0]])


def mass_properties(solids: list[tuple[Manifold, float]]) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass (kg), centre of mass ``(3,)`` m and inertia ``(3, 3)`` kg m^2 about it of solids of given densities."""
    pieces = []
    for solid, density in solids:
        mesh = solid.to_mesh()
        surface = trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts), process=False)
        mass = density * float(solid.volume())
        pieces.append((mass, solid_mass_properties(surface, mass)))
    total = sum(mass for mass, _ in pieces)
    center = np.sum([mass * piece.center_of_mass_m for mass, piece in pieces], axis=0) / total
    inertia = np.zeros((3, 3))
    for mass, piece in pieces:
        arm = piece.center_of_mass_m - center
        inertia += piece.inertia_kg_m2 + mass * ((arm @ arm) * np.eye(3) - np.outer(arm, arm))
    return total, center, inertia
