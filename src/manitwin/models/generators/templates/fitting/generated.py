"""A fitted template as the result of a generator: textured mesh, known annotations, and confidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import trimesh
from trimesh.visual import TextureVisuals

from manitwin.formats.meshes.shading_normals import with_creased_normals
from manitwin.models.generators.photo_material import photo_material
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.fit import TemplateFit
from manitwin.models.generators.templates.fitting.texturing import FittedPhoto, TexturedSolid, texture_solid
from manitwin.models.generators.templates.fitting.view import apply_yaw
from manitwin.models.generators.templates.ground_truth import object_import_record
from manitwin.models.generators.templates.template import Vector
from manitwin.models.generators.templates.template_object import given_parts
from manitwin.twin.import_record import FITTED, ImportRecord


def rotate_front_to_camera(fitted: TemplateFit) -> TemplateFit:
    """Return the fit of an upright object without a natural front, rotated so that its visible side is towards -Y."""
    if not load_templates()[fitted.category].any_front or not fitted.upright:
        return fitted
    made, yaw_rad = fitted.made, fitted.view.yaw_rad
    turn = trimesh.transformations.rotation_matrix(yaw_rad, [0, 0, 1])[:3, :3]

    def turned(vector: Vector) -> Vector:
        x, y, z = (turn @ vector).tolist()
        return (x, y, z)

    view, vertices = apply_yaw(fitted.view, made.mesh.vertices)
    points = [replace(p, position_m=turned(p.position_m), direction=turned(p.direction)) for p in made.points]
    solids = [(solid.rotate((0, 0, float(np.degrees(yaw_rad)))), density) for solid, density in made.solids]
    mesh = replace(made.mesh, vertices=vertices)
    return replace(fitted, made=replace(made, mesh=mesh, points=tuple(points), solids=solids), view=view)


def texture_fit(fitted: Sequence[TemplateFit], photos: Sequence[np.ndarray]) -> TexturedSolid:
    """Return the solid fitted to photos ``(H, W, 4) uint8``, textured from the photo that shows each face best."""
    made = fitted[0].made
    colours = {part: look.rgb for part, look in made.looks.items()}
    shots = [FittedPhoto(fit.view, rgba, fit.center_px, fit.box_px) for fit, rgba in zip(fitted, photos, strict=True)]
    return texture_solid(made.mesh, shots, colours)


def visual_part(surface: TexturedSolid) -> trimesh.Trimesh:
    """Return the mesh in the object frame with its texture."""
    vertices, faces, uv = surface.mesh()
    material = photo_material(surface.texture)
    visual = TextureVisuals(uv=uv, material=material)
    mesh = trimesh.Trimesh(vertices, faces, visual=visual, process=False, metadata={"name": "fitted"})
    return with_creased_normals(mesh)


def fit_import_record(fitted: TemplateFit, name: str, surface: TexturedSolid) -> ImportRecord:
    """Return the import record of a fitted object with its texture: category, parts and functional points.

    The mass is omitted, since a photo determines neither size nor material.
    """
    known = object_import_record(fitted.made, name)
    return known.model_copy(
        update={
            "format": FITTED,
            "mass_kg": None,
            "center_of_mass_m": None,
            "inertia_kg_m2": None,
            "material": None,
            "parts": given_parts(fitted.made.mesh.names, surface.part, surface.vertices, surface.faces),
            "missing": ["mass", "material", *known.missing],
        }
    )


def fit_notes(fitted: TemplateFit) -> dict[str, Any]:
    """Return how the shape was found, for the record."""
    view, residual = fitted.view, fitted.residual
    return {
        "primitive": f"template:{fitted.category}",
        "source": "template fitted to the photo",
        "category": fitted.category,
        "confidence": round(fitted.confidence, 3),
        "residual": {
            "iou": round(residual.iou, 4),
            "outline": round(residual.outline, 5),
            "edges": round(residual.edges, 3),
            "shading": round(residual.shading, 3),
        },
        "measures": {name: round(value, 6) for name, value in fitted.made.measures.items()},
        "view": {
            "yaw_deg": round(float(np.degrees(view.yaw_rad)), 1),
            "elevation_deg": round(float(np.degrees(view.elevation_rad)), 1),
            "roll_deg": round(float(np.degrees(view.roll_rad)), 1),
            "perspective": round(view.perspective, 4),
        },
    }
