"""Volume, centre of mass and inertia of solids and thin shells, exact for the given triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh


@dataclass(frozen=True)
class MassProperties:
    """Centre of mass ``(3,)`` m, inertia ``(3, 3)`` about it in object axes, and volume of material."""

    center_of_mass_m: np.ndarray
    inertia_kg_m2: np.ndarray
    volume_m3: float


TRIANGLE_SLACK = 1e-9
"""Margin of the triangle inequality of principal moments, relative to the largest, so that rounding does not violate it."""


def with_triangle_slack(inertia_kg_m2: np.ndarray) -> np.ndarray:
    """Return an inertia ``(3, 3)`` that satisfies the triangle inequality A + B > C despite rounding, as MuJoCo requires."""
    tensor = (inertia_kg_m2 + inertia_kg_m2.T) / 2
    least, middle, most = np.linalg.eigvalsh(tensor)
    lacks = TRIANGLE_SLACK * most - (least + middle - most)
    return np.asarray(tensor + max(lacks, 0.0) * np.eye(3))


def solid_mass_properties(mesh: trimesh.Trimesh, mass_kg: float) -> MassProperties:
    """Return the mass properties of a watertight mesh of uniform density.

    Source: divergence theorem over signed tetrahedra from the origin (Mirtich 1996; Eberly, Polyhedral mass properties).
    """
    center = mesh.bounds.mean(0)  # an origin near the mesh reduces cancellation
    corners = mesh.triangles - center
    volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    volume = float(volumes.sum())
    total = corners.sum(1)
    first = (volumes[:, None] * total).sum(0) / 4
    second = _weighted_second_moment(volumes / 20, corners, total)
    offset = first / volume
    second = second / volume - np.outer(offset, offset)
    return MassProperties(center + offset, mass_kg * _inertia_from_second_moment(second), volume)


def shell_mass_properties(mesh: trimesh.Trimesh, mass_kg: float, wall_thickness_m: float) -> MassProperties:
    """Return the mass properties of a wall of uniform thickness whose outer surface is the mesh.

    The wall is represented by its middle surface: every vertex is moved inward by half the thickness. The volume is area times
    thickness.

    Source: exact triangle moments, as for a lamina (per triangle A/12 (sum of t t^T + s s^T), with s the sum of the corners).
    """
    corners = _moved_inward(mesh, wall_thickness_m / 2)[mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    area = float(areas.sum())
    center = (areas[:, None] * corners.mean(1)).sum(0) / area
    corners = corners - center
    second = _weighted_second_moment(areas / 12, corners, corners.sum(1)) / area
    return MassProperties(center, mass_kg * _inertia_from_second_moment(second), area * wall_thickness_m)


def _weighted_second_moment(weights: np.ndarray, corners: np.ndarray, total: np.ndarray) -> np.ndarray:
    return np.einsum("n,nij,nik->jk", weights, corners, corners) + np.einsum("n,nj,nk->jk", weights, total, total)


def _inertia_from_second_moment(second: np.ndarray) -> np.ndarray:
    inertia = np.trace(second) * np.eye(3) - second
    return (inertia + inertia.T) / 2


def _moved_inward(mesh: trimesh.Trimesh, offset_m: float) -> np.ndarray:
    """Return the vertices ``(V, 3)`` moved so that every face moves by about ``offset_m`` against its normal.

    Each vertex solves a least-squares problem over the planes of its faces, so that box corners are preserved; steps are
    limited to 3 offsets.
    """
    normals, angles = mesh.face_normals, mesh.face_angles
    outer = np.zeros((len(mesh.vertices), 3, 3))
    mean = np.zeros((len(mesh.vertices), 3))
    for corner in range(3):
        weight = angles[:, corner]
        np.add.at(outer, mesh.faces[:, corner], weight[:, None, None] * normals[:, :, None] * normals[:, None, :])
        np.add.at(mean, mesh.faces[:, corner], weight[:, None] * normals)
    damping = 1e-3 * np.trace(outer, axis1=1, axis2=2) + 1e-12
    step = np.linalg.solve(outer + damping[:, None, None] * np.eye(3), mean[..., None])[..., 0]
    length = np.linalg.norm(step, axis=1, keepdims=True)
    step *= np.minimum(1.0, 3.0 / np.maximum(length, 1e-12))
    return mesh.vertices - offset_m * step
