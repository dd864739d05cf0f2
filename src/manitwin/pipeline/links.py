"""Links and joints of an imported articulated object, transformed to the object frame and scaled to the twin's size."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from manitwin.engine.stage import Draft
from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh
from manitwin.geometry.articulation import ArticulatedBody
from manitwin.geometry.mass_properties import solid_mass_properties, with_triangle_slack
from manitwin.geometry.parts.segmentation import transfer_face_labels
from manitwin.geometry.poses import transform_points
from manitwin.geometry.repair.cascade import repair
from manitwin.geometry.rigid_body import RigidBody
from manitwin.pipeline.item import Item
from manitwin.pipeline.object_state import load_hulls, load_visual, read_given
from manitwin.twin.link_records import Articulation, Link

_ROUNDING = 1e-9  # relative to the mass


@dataclass(frozen=True)
class LinkMass:
    """Mass, centre of mass ``(3,)`` and inertia ``(3, 3)`` about it of one link in the object frame, with their source."""

    mass_kg: float
    center_of_mass_m: np.ndarray
    inertia_kg_m2: np.ndarray
    source: str


def read_articulation(draft: Draft[Item]) -> Articulation | None:
    """Return an object's articulation in the object frame at its current size; None for a rigid object."""
    given = read_given(draft)
    if given is None or given.articulation is None:
        return None
    return given.articulation.scaled(_scale(draft))


def face_links(draft: Draft[Item], articulation: Articulation, mesh: trimesh.Trimesh) -> np.ndarray:
    """Return the link of each face ``(F,) uint8`` of a mesh of the object: that of the nearest place on the imported surface.

    Raises InputError if the imported mesh does not match its import.json.
    """
    assert draft.payload.file is not None
    parts = read_mesh(Path(draft.payload.file)).parts
    if len(parts) != len(articulation.link_of_mesh):
        raise InputError(
            "unreadable",
            f"{Path(draft.payload.file).name}: has {len(parts)} meshes, its import.json lists the links of"
            f" {len(articulation.link_of_mesh)}; import the asset again",
        )
    vertices, faces = trimesh.util.append_faces([part.vertices for part in parts], [part.faces for part in parts])
    to_object = np.diag([*[_scale(draft)] * 3, 1.0]) @ np.array(draft.field("geometry")["input_to_object"])
    imported = trimesh.Trimesh(transform_points(to_object, vertices), faces, process=False)
    labels = np.repeat(np.array(articulation.link_of_mesh, np.uint8), [len(part.faces) for part in parts])
    return transfer_face_labels(labels, imported, mesh)


def link_solids(solid: trimesh.Trimesh, labels: np.ndarray, count: int) -> list[trimesh.Trimesh]:
    """Return the closed solid of each link; where repair had joined links, the cuts are closed again."""
    found = []
    for link in range(count):
        faces = np.asarray(solid.faces)[labels == link]
        used, inverse = np.unique(faces, return_inverse=True)
        piece = trimesh.Trimesh(np.asarray(solid.vertices)[used], inverse.reshape(-1, 3), process=False)
        found.append(piece if piece.is_watertight else repair(piece).mesh)
    return found


def shape_of_link(solid: trimesh.Trimesh, hulls: list[int]) -> dict[str, Any]:
    """Return the hulls of a link's solid, and its mass properties for one kilogram."""
    even = solid_mass_properties(solid, 1.0)
    return {
        "hulls": hulls,
        "volume_m3": even.volume_m3,
        "center_of_mass_m": even.center_of_mass_m.tolist(),
        "inertia_m2": even.inertia_kg_m2.tolist(),
    }


def link_masses(draft: Draft[Item], articulation: Articulation) -> list[LinkMass]:
    """Return the mass properties of the links, which add up to the twin's mass.

    If the asset states mass and centre of mass of all links, these are used (scaled to the twin's mass), with the inertia of a
    uniform solid where it is missing. Otherwise all links are uniform solids with one density.
    """
    shapes, mass_kg = draft.field("collision")["links"], draft.field("physical")["mass_kg"]["value"]
    given = read_given(draft)
    total_kg = sum(link.mass_kg or 0.0 for link in articulation.links)
    ratio = mass_kg / total_kg if total_kg and abs(mass_kg / total_kg - 1) > _ROUNDING else 1.0
    kept = []
    for link, shape in zip(articulation.links, shapes, strict=True):
        if link.mass_kg is None or link.center_of_mass_m is None or given is None:
            break
        even = link.mass_kg * np.array(shape["inertia_m2"])
        lacks = link.inertia_kg_m2 is None
        inertia = with_triangle_slack(ratio * (even if lacks else np.array(link.inertia_kg_m2)))
        source = f"{given.source}, inertia of an even filling" if lacks else given.source
        kept.append(LinkMass(ratio * link.mass_kg, np.array(link.center_of_mass_m), inertia, source))
    if len(kept) == len(articulation.links):
        return kept
    density = mass_kg / sum(shape["volume_m3"] for shape in shapes)
    masses = [density * shape["volume_m3"] for shape in shapes]
    return [
        LinkMass(own, np.array(shape["center_of_mass_m"]), own * np.array(shape["inertia_m2"]), "density*volume")
        for own, shape in zip(masses, shapes, strict=True)
    ]


def link_table(draft: Draft[Item], articulation: Articulation, labels: np.ndarray) -> list[Link]:
    """Return the twin's links; ``labels (F,)`` are the links of the faces of visual.glb."""
    masses, shapes = link_masses(draft, articulation), draft.field("collision")["links"]
    return [
        Link(
            name=link.name,
            mass_kg=mass.mass_kg,
            center_of_mass_m=mass.center_of_mass_m.tolist(),
            inertia_kg_m2=mass.inertia_kg_m2.tolist(),
            source=mass.source,
            hulls=shape["hulls"],
            faces=int((labels == place).sum()),
        )
        for place, (link, mass, shape) in enumerate(zip(articulation.links, masses, shapes, strict=True))
    ]


def visual_labels(draft: Draft[Item], articulation: Articulation) -> np.ndarray:
    """Return the link of each face of visual.glb."""
    meshes = load_visual(draft.path("visual.glb"))
    vertices, faces = trimesh.util.append_faces([m.vertices for m in meshes], [m.faces for m in meshes])
    return face_links(draft, articulation, trimesh.Trimesh(vertices, faces, process=False))


def articulated_body(draft: Draft[Item], articulation: Articulation) -> ArticulatedBody:
    """Return the links as rigid bodies with their joints."""
    hulls, physical = load_hulls(draft.path("hulls.npz")), draft.field("physical")
    names = [link.name for link in articulation.links]
    links = tuple(
        RigidBody(
            hulls=tuple(hulls[number] for number in shape["hulls"]),
            mass_kg=mass.mass_kg,
            center_of_mass_m=mass.center_of_mass_m,
            inertia_kg_m2=mass.inertia_kg_m2,
            friction_static=physical["friction_static"]["value"],
            friction_dynamic=physical["friction_dynamic"]["value"],
        )
        for mass, shape in zip(link_masses(draft, articulation), draft.field("collision")["links"], strict=True)
    )
    return ArticulatedBody(links, tuple(joint.articulated(names) for joint in articulation.joints))


def _scale(draft: Draft[Item]) -> float:
    """Return the scale factor applied since the object was brought to the object frame."""
    if "solid.npz" not in draft.paths:
        return 1.0
    sizes = []
    for name in ("solid.npz", "canonical.npz"):
        with np.load(draft.path(name)) as arrays:
            sizes.append(float(np.ptp(arrays["vertices"], axis=0).max()))
    return sizes[0] / sizes[1]
