"""Object models in BOP's format: meshes in millimetres centred on their bounding box, and their symmetries."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from manitwin.geometry.poses import transform
from manitwin.geometry.sampling import sample_surface
from manitwin.geometry.symmetry import Symmetries, find_symmetries
from manitwin.models.annotators.surface_color import base_colors_at
from manitwin.render.raycast import merge_parts
from manitwin.twin.loaded_twin import Twin

MM = 1000.0
_INTO_FACE = 0.01  # share of the way to the face's centre
COLOR_SAMPLES = 4000
MOST_COLOR_APART = 24.0
"""Of 255, the median RGB distance between a surface and its rotated copy that capture noise and shading explain."""


@dataclass(frozen=True)
class BopModel:
    """A twin as a BOP object: its mesh in the object frame (m), and the base colour ``(V, 3) uint8`` sRGB of each vertex."""

    twin_id: str
    mesh: trimesh.Trimesh
    colors: np.ndarray

    @classmethod
    def of_twin(cls, folder: Path) -> BopModel:
        """Read the model from a twin's folder; raises TwinError."""
        twin = Twin(folder)
        mesh = merge_parts(twin.visual)
        colors = np.concatenate([_vertex_colors(part) for part in twin.visual])
        return cls(twin.record.twin_id, mesh, colors)

    @property
    def center_m(self) -> np.ndarray:
        """The centre of the bounding box, BOP's origin, in the object frame."""
        return np.asarray(self.mesh.bounds.mean(0))

    @property
    def bop_to_object(self) -> np.ndarray:
        """The pose ``(4, 4)`` of BOP's model frame in the object frame, m."""
        return transform(translation=self.center_m)

    def ply(self) -> bytes:
        """Return the mesh as a binary PLY in millimetres, centred on its bounding box."""
        moved = self.mesh.copy()
        moved.visual = trimesh.visual.ColorVisuals(moved, vertex_colors=self.colors)
        moved.apply_translation(-self.center_m)
        moved.apply_scale(MM)
        content = moved.export(file_type="ply", vertex_normal=True)
        assert isinstance(content, bytes)
        return content

    @cached_property
    def symmetries(self) -> Symmetries:
        """The symmetries of its shape."""
        return find_symmetries(self.mesh, np.random.default_rng(0))

    def info(self) -> dict[str, Any]:
        """Return its entry in ``models_info.json``: bounding box, diameter and symmetries.

        Symmetries of the shape have BOP's names, those of shape and colour additional names: a printed box is symmetric only in
        depth pictures.
        """
        low_mm = (self.mesh.bounds[0] - self.center_m) * MM
        extents_mm = self.mesh.extents * MM
        info: dict[str, Any] = {"diameter": _diameter(np.asarray(self.mesh.vertices)) * MM}
        info |= {f"min_{axis}": float(low_mm[i]) for i, axis in enumerate("xyz")}
        info |= {f"size_{axis}": float(extents_mm[i]) for i, axis in enumerate("xyz")}
        turns = [motion for motion in self.symmetries.motions[1:] if np.linalg.det(motion) > 0]
        same_color = [motion for motion in turns if self._same_color(motion)]
        info |= self._named(turns, self.symmetries.axis is not None, "")
        round_in_color = self.symmetries.axis is not None and all(
            self._same_color(_axis_rotation(self.symmetries.axis, angle)) for angle in (0.7, 1.9, 3.3)
        )
        info |= self._named(same_color, round_in_color, "_with_color")
        return info

    def _named(self, turns: list[np.ndarray], is_round: bool, suffix: str) -> dict[str, Any]:
        """Return symmetries in BOP's form, in mm about its origin; a body of revolution keeps a rotation that swaps its ends.

        A ball has three continuous axes and keeps the rotations of a cube: BOP combines each rotation with those about each
        axis.
        """
        found: dict[str, Any] = {}
        offset_mm = (self.symmetries.center_m - self.center_m) * MM
        axis = self.symmetries.axis
        if is_round and axis is not None:
            ball = self.symmetries.ball
            axes = (axis, *(motion @ axis for motion in turns)) if ball else (axis,)
            apart = [each for i, each in enumerate(axes) if all(abs(each @ other) < 0.5 for other in axes[:i])]
            found[f"symmetries_continuous{suffix}"] = [
                {"axis": each.tolist(), "offset": offset_mm.tolist()} for each in apart
            ]
            turns = turns if ball else [motion for motion in turns if motion @ axis @ axis < 0][:1]
        if turns:
            found[f"symmetries_discrete{suffix}"] = [
                transform(motion, offset_mm - motion @ offset_mm).ravel().tolist() for motion in turns
            ]
        return found

    @cached_property
    def _colored(self) -> tuple[np.ndarray, np.ndarray, cKDTree]:
        points, _, faces = sample_surface(self.mesh, COLOR_SAMPLES, np.random.default_rng(0))
        colors = self.colors[np.asarray(self.mesh.faces)[faces]].mean(1)
        return points, colors, cKDTree(points)

    def _same_color(self, motion: np.ndarray) -> bool:
        points, colors, tree = self._colored
        center = self.symmetries.center_m
        _, nearest = tree.query((points - center) @ motion.T + center)
        apart = np.linalg.norm(colors[nearest] - colors, axis=1)
        return bool(np.median(apart) < MOST_COLOR_APART and np.mean(apart > 3 * MOST_COLOR_APART) < 0.05)


def _vertex_colors(part: trimesh.Trimesh) -> np.ndarray:
    """Return the base colour ``(V, 3) uint8`` sRGB at the vertices of a visual part."""
    corners = np.asarray(part.faces)
    face = np.zeros(len(part.vertices), int)
    face[corners.ravel()] = np.repeat(np.arange(len(corners)), 3)
    # off the vertex itself, because a texture wraps around at its border
    at = _INTO_FACE * part.triangles_center[face] + (1 - _INTO_FACE) * np.asarray(part.vertices)
    return np.rint(255 * base_colors_at(part, face, at)).astype(np.uint8)


def _diameter(vertices_m: np.ndarray) -> float:
    corners = trimesh.convex.convex_hull(vertices_m).vertices
    return float(pdist(corners).max())


def _axis_rotation(axis: np.ndarray, angle_rad: float) -> np.ndarray:
    return np.asarray(trimesh.transformations.rotation_matrix(angle_rad, axis)[:3, :3])
