"""Ground-truth annotations of a generated object as an import record: name, mass properties, material and points."""

from __future__ import annotations

import numpy as np
import trimesh
from manifold3d import Manifold

from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.models.annotators.prior_names import found_by, object_noun
from manitwin.models.generators.templates.known_frames import known_frame
from manitwin.models.generators.templates.looks import MATERIAL_WORDING
from manitwin.models.generators.templates.template import OFF_SURFACE_KINDS, KnownPoint
from manitwin.models.generators.templates.template_object import TemplateObject, face_parts
from manitwin.twin.import_record import GivenPoint, ImportRecord

MOST_POINTS = 4
"""Maximum number of functional points of an object (paper)."""
_HEAVY_KG_M3, _HEAVIER = 3000.0, 1.5
"""A part has an iron core if its density exceeds both this value and this multiple of its surface material's density."""
_TELLING_SHARE = 0.25  # minimum share of mass and surface (mean) of a material that is named


def object_import_record(made: TemplateObject, text: str) -> ImportRecord:
    """Return the import record of an object in its object frame.

    The mass follows from the volumes and densities of the parts, including contents for closed containers. Centre of mass and
    inertia are summed over the parts (parallel axis theorem).
    """
    mass_kg, center, inertia = mass_properties(made.solids)
    return ImportRecord(
        format="template",
        file=text,
        name=made.category,
        category=_name_in_text(made.category, text),
        license=None,
        attribution=None,
        asset_to_object=np.eye(4).tolist(),
        mass_kg=mass_kg,
        center_of_mass_m=center.tolist(),
        inertia_kg_m2=inertia.tolist(),
        friction_static=None,
        friction_dynamic=None,
        restitution=None,
        material=material_words(made),
        captions=[],
        functional_points=[
            GivenPoint(
                position_m=_on_surface(made, point).tolist(),
                normal=list(point.direction),
                label=point.label,
                # A "surface" point gets its frame from geometry, such as the axis of a handle.
                frame=None if point.kind == "surface" else known_frame(made, point, center),
            )
            for point in made.points[:MOST_POINTS]
        ],
        grasp_points=[],
        grasps=[],
        rests=[],
        missing=["friction", "restitution", "grasps"],
        remarks=[],
        parts=face_parts(made),
    )


def _name_in_text(category: str, text: str) -> str:
    """Return the object's name in a text if the priors list it for this category or a kin of equal shape; else the category."""
    found = found_by(text)
    if found is None or category not in (found[0].category, found[0].kin_of):
        return category
    return object_noun(*found)


def material_words(made: TemplateObject) -> str:
    """Return the one or two main materials by their shares of mass and surface, such as 'steel and wood'.

    A coated part with the density of metal counts as iron inside and as its coating on the surface: 'iron and rubber'.
    """
    shares: dict[str, float] = {}
    total_kg = sum(made.masses_kg.values())
    corners = made.mesh.vertices[made.mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    for number, part in enumerate(made.mesh.names):
        look, mass_kg = made.looks[part], made.masses_kg.get(part, 0.0)
        is_core = made.densities_kg_m3.get(part, 0.0) > max(_HEAVY_KG_M3, _HEAVIER * look.density_kg_m3)
        inside = "iron" if is_core else look.material
        for material, share in (
            (inside, mass_kg / total_kg),
            (look.material, float(areas[made.mesh.part == number].sum() / areas.sum())),
        ):
            shares[material] = shares.get(material, 0.0) + share / 2
    ranked = sorted(shares, key=lambda material: -shares[material])[:2]
    told = [material for material in ranked if shares[material] >= _TELLING_SHARE] or ranked[:1]
    said = [MATERIAL_WORDING.get(material, material) for material in told]
    return said[0] if len(said) < 2 or said[1] in said[0] else " and ".join(said)


def _on_surface(made: TemplateObject, point: KnownPoint) -> np.ndarray:
    """Return the position of a point on the surface; for openings, holes and axes the nearest face centre of the part, towards
    -Y.
    """
    position = np.array(point.position_m)
    if point.kind not in OFF_SURFACE_KINDS:
        return position
    centers = made.mesh.vertices[made.mesh.faces[made.mesh.faces_of(point.part)]].mean(axis=1)
    away = np.linalg.norm(centers - position, axis=1)
    return np.asarray(centers[np.lexsort((centers[:, 1], np.round(away, 3)))[0]])


def mass_properties(solids: list[tuple[Manifold, float]]) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass (kg), centre of mass ``(3,)`` m and inertia ``(3, 3)`` kg m^2 about it, of solids with given densities."""
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
