"""Generated object: mesh with parts, looks and masses, and its visual meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from manifold3d import Manifold
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from manitwin.formats.meshes.shading_normals import with_creased_normals
from manitwin.formats.meshes.textures import srgb_to_linear
from manitwin.geometry.seams import has_distinct_corners
from manitwin.geometry.solids.parts import PartedMesh
from manitwin.models.generators.templates.looks import Look
from manitwin.models.generators.templates.template import KnownPoint
from manitwin.twin.import_record import GivenParts


@dataclass(frozen=True)
class TemplateObject:
    """A generated object: mesh with parts, looks by part, known points, measures, and masses (kg) and densities (kg/m^3) by part.

    ``solids`` are the disjoint contributions of the parts with their densities (kg/m^3).
    """

    category: str
    mesh: PartedMesh
    looks: dict[str, Look]
    points: tuple[KnownPoint, ...]
    measures: dict[str, float]
    solids: list[tuple[Manifold, float]]
    masses_kg: dict[str, float]
    densities_kg_m3: dict[str, float]


def visual_parts(made: TemplateObject) -> list[trimesh.Trimesh]:
    """Return one mesh per look with its PBR material, in the object frame; parts with equal looks are merged."""
    parts = []
    for look, names, index in _by_look(made):
        faces = made.mesh.faces[index]
        used, compact = np.unique(faces, return_inverse=True)
        linear = srgb_to_linear(np.array(look.rgb))
        material = PBRMaterial(
            name=f"{look.material} {names[0]}",
            baseColorFactor=[*(round(255 * float(c)) for c in linear), 255],
            metallicFactor=look.metallic,
            roughnessFactor=look.roughness,
        )
        mesh = trimesh.Trimesh(
            made.mesh.vertices[used],
            compact.reshape(-1, 3),
            visual=TextureVisuals(material=material),
            process=False,
            metadata={"name": names[0]},
        )
        parts.append(with_creased_normals(mesh))
    return parts


def face_parts(made: TemplateObject) -> GivenParts:
    """Return the part of each face of ``visual_parts``, in the order in which their file is read back."""
    order = np.concatenate([index for _, _, index in _by_look(made)])
    return given_parts(made.mesh.names, made.mesh.part[order], made.mesh.vertices, made.mesh.faces[order])


def given_parts(names: Sequence[str], part: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> GivenParts:
    """Return the parts ``(F,)`` of faces ``(F, 3)``, without faces that degenerate to lines in single precision."""
    kept = has_distinct_corners(np.asarray(vertices, np.float32), faces)
    return GivenParts(names=list(names), of_face=part[kept].tolist())


def _by_look(made: TemplateObject) -> list[tuple[Look, list[str], np.ndarray]]:
    """Return each look with its parts and the indices of their faces."""
    by_look: dict[Look, list[str]] = {}
    for part in made.mesh.names:
        by_look.setdefault(made.looks[part], []).append(part)
    numbered = [
        (look, names, np.flatnonzero(np.isin(made.mesh.part, [made.mesh.names.index(name) for name in names])))
        for look, names in by_look.items()
    ]
    return [each for each in numbered if len(each[2])]
