"""Solids of known shape, in the object frame: standing on z = 0, metres."""

from __future__ import annotations

import numpy as np
import trimesh
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from manitwin.geometry.sampling import farthest_point_sampling, sample_surface
from manitwin.models.annotators.protocol import Subject


def cylinder(radius_m: float, height_m: float, z_m: float = 0.0) -> trimesh.Trimesh:
    """An upright cylinder whose base is at ``z_m``."""
    mesh = trimesh.creation.cylinder(radius=radius_m, height=height_m, sections=64)
    mesh.apply_translation([0, 0, z_m + height_m / 2])
    return mesh


def cup(radius_m: float = 0.04, height_m: float = 0.1, wall_m: float = 0.003) -> trimesh.Trimesh:
    """An open cup, wall and floor equally thick."""
    hollow = cylinder(radius_m - wall_m, height_m, wall_m)
    return trimesh.boolean.difference([cylinder(radius_m, height_m), hollow], engine="manifold")


def mug() -> trimesh.Trimesh:
    """A cup of 40 mm radius and 100 mm height with a ring handle towards +x that reaches 75 mm from the axis."""
    ring = trimesh.creation.torus(major_radius=0.03, minor_radius=0.005)
    ring.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    ring.apply_translation([0.04, 0, 0.05])
    handle = trimesh.boolean.difference([ring, cylinder(0.0385, 0.1)], engine="manifold")
    return trimesh.boolean.union([cup(), handle], engine="manifold")


def hammer() -> trimesh.Trimesh:
    """A hammer that lies along x: a head of 30 x 100 x 30 mm at x = 0, a handle of 20 mm up to x = 0.3."""
    head = trimesh.creation.box([0.03, 0.1, 0.03])
    handle = trimesh.creation.box([0.3, 0.02, 0.02])
    handle.apply_translation([0.15, 0, 0])
    mesh = trimesh.boolean.union([head, handle], engine="manifold")
    mesh.apply_translation([0, 0, 0.015])
    return mesh


def screwdriver() -> trimesh.Trimesh:
    """A screwdriver that lies along x: a shaft of 6 mm from x = 0 to 0.1, a handle of 30 mm from there to 0.2."""
    shaft = trimesh.creation.box([0.11, 0.006, 0.006])
    shaft.apply_translation([0.055, 0, 0.015])
    grip = trimesh.creation.box([0.1, 0.03, 0.03])
    grip.apply_translation([0.15, 0, 0.015])
    return trimesh.boolean.union([shaft, grip], engine="manifold")


def visual(mesh: trimesh.Trimesh, **material: object) -> trimesh.Trimesh:
    """The mesh as a visual part with a material and no texture coordinates."""
    part = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    part.visual = TextureVisuals(material=PBRMaterial(metallicFactor=0.0, roughnessFactor=0.8, **material))
    part.metadata["name"] = "part"
    return part


def subject(mesh: trimesh.Trimesh, name: str | None, *, metric: bool = True, parts: tuple = ()) -> Subject:
    """The mesh as an annotator sees it."""
    return Subject(name=name, solid=mesh, parts=parts, metric=metric, views=(), cameras=(), seed=0)


def candidates(mesh: trimesh.Trimesh, count: int = 42) -> tuple[np.ndarray, np.ndarray]:
    """Far-apart surface points ``(count, 3)`` and their normals."""
    points, normals, _ = sample_surface(mesh, 20_000, np.random.default_rng(0))
    chosen = farthest_point_sampling(points, count)
    return points[chosen], normals[chosen]


def drill(grip_x_m: float = -0.02, foot: bool = True) -> trimesh.Trimesh:
    """A lying drill: its barrel along X with the chuck at +X, its grip towards -Y, a battery foot that reaches forward."""
    forward = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0])
    parts = [
        cylinder(0.03, 0.17).apply_transform(forward).apply_translation([-0.08, 0, 0]),
        cylinder(0.015, 0.06).apply_transform(forward).apply_translation([0.09, 0, 0]),
        trimesh.creation.box([0.04, 0.11, 0.035]).apply_translation([grip_x_m, -0.08, 0]),
    ]
    if foot:
        parts.append(trimesh.creation.box([0.12, 0.05, 0.05]).apply_translation([grip_x_m + 0.02, -0.15, 0]))
    return trimesh.boolean.union(parts)
