"""A functional frame, or the reason for which there is none; and the mesh that frames are looked for on."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.geometry.cavity import Opening, find_opening
from manitwin.geometry.parts.protrusions import RoundBody, round_body
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface

Kind = Literal["opening", "face", "tip", "edge", "hole", "axis", "button", "surface"]
UP = np.array([0.0, 0.0, 1.0])
_SAMPLES = 6000
_LOCAL_SAMPLES, _MOST_LOCAL_SAMPLES = 500, 200_000  # within a circle of that radius, of all faces that reach into it


@dataclass(frozen=True)
class FeatureFrame:
    """A feature's frame in the object frame: ``position_m (3,)``, ``rotation (3, 3)`` with the columns X, Y, Z.

    Z is the functional direction, X the second one; ``size_m`` a radius, of an edge and an axis the length. ``roll_free``:
    any turn about Z serves as well.
    """

    kind: Kind
    position_m: np.ndarray
    rotation: np.ndarray
    size_m: float
    roll_free: bool

    @property
    def z(self) -> np.ndarray:
        """The functional direction, ``(3,)``."""
        return self.rotation[:, 2]

    @property
    def x(self) -> np.ndarray:
        """The second direction, ``(3,)``."""
        return self.rotation[:, 0]


@dataclass(frozen=True)
class Unclear:
    """Why there is no frame, in words that complete 'no frame: ...'."""

    reason: str


Found = FeatureFrame | Unclear


def rotation_of(z: np.ndarray, x: np.ndarray = UP) -> np.ndarray:
    """Return the rotation ``(3, 3)`` with the third column along ``z (3,)`` and the first as near to ``x (3,)`` as can be.

    Where both are parallel, the first is as near to the object's X as can be.
    """
    z = z / np.linalg.norm(z)
    for wanted in (x, np.array([1.0, 0, 0]), np.array([0.0, 1, 0])):
        across = wanted - (wanted @ z) * z
        length = float(np.linalg.norm(across))
        if length > 1e-3 * float(np.linalg.norm(wanted)):
            break
    across = across / length
    return np.stack([across, np.cross(z, across), z], axis=1)


@dataclass(frozen=True)
class FramedMesh:
    """A watertight mesh in the object frame with what all frames share, measured when first asked for.

    ``seed`` is that of its samples; ``known_opening`` saves looking for one that is known already.
    """

    mesh: trimesh.Trimesh
    center_of_mass_m: np.ndarray
    seed: int = 0
    known_opening: Opening | None = field(default=None)

    @cached_property
    def size_m(self) -> float:
        """The longest side of the box along the axes, m."""
        return float(self.mesh.extents.max())

    @cached_property
    def caster(self) -> RayCaster:
        """The mesh prepared for rays."""
        return RayCaster(self.mesh)

    @cached_property
    def opening(self) -> Opening | None:
        """The largest hollow that would hold water."""
        return self.known_opening or find_opening(self.mesh)

    @cached_property
    def samples(self) -> tuple[np.ndarray, np.ndarray]:
        """Samples of the surface: positions ``(6000, 3)`` m and the normals of their faces."""
        positions, normals, _ = sample_surface(self.mesh, _SAMPLES, np.random.default_rng(self.seed))
        return positions, normals

    @cached_property
    def tree(self) -> cKDTree:
        """A tree over the positions of ``samples``."""
        return cKDTree(self.samples[0])

    @cached_property
    def corners(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The faces with equal corners joined ``(F, 3)``, their centres and normals ``(F, 3)`` and areas ``(F,)`` m2."""
        _, joined = np.unique(np.round(self.mesh.vertices, 7), axis=0, return_inverse=True)
        faces = joined.reshape(-1)[self.mesh.faces]
        return faces, self.mesh.triangles_center, np.asarray(self.mesh.face_normals), self.mesh.area_faces

    @cached_property
    def spacing_m(self) -> float:
        """How far apart neighbouring samples are in the mean."""
        return float(np.sqrt(self.mesh.area / _SAMPLES))

    def body(self, axis_xy_m: np.ndarray | None) -> RoundBody:
        """Return the upright body about a vertical axis, with what sticks out of it."""
        return round_body(self.samples[0], axis_xy_m)

    def near(self, point_m: np.ndarray, radius_m: float) -> np.ndarray:
        """Return the indices of the samples within a radius of a point."""
        return np.array(sorted(self.tree.query_ball_point(point_m, radius_m)), dtype=int)

    def mean_normal(self, point_m: np.ndarray, normal: np.ndarray, radius_m: float) -> np.ndarray:
        """Return the mean ``(3,)`` of unit normals by area within a radius of a point, on its side: shorter as they differ.

        Samples are drawn anew of the faces there: those of the whole are too far apart for a thin part.
        """
        triangles, centers = self.mesh.triangles, self.mesh.triangles_center
        reach_m = radius_m + np.linalg.norm(triangles - centers[:, None], axis=2).max(1)
        near = np.flatnonzero(np.linalg.norm(centers - point_m, axis=1) <= reach_m)
        if not len(near):
            return np.zeros(3)
        corners = triangles[near].reshape(-1, 3)
        there = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
        count = int(np.clip(_LOCAL_SAMPLES * there.area / (np.pi * radius_m**2), _LOCAL_SAMPLES, _MOST_LOCAL_SAMPLES))
        positions, normals, _ = sample_surface(there, count, np.random.default_rng(self.seed))
        mine = (np.linalg.norm(positions - point_m, axis=1) <= radius_m) & (normals @ normal > 0)
        return np.asarray(normals[mine].mean(0)) if mine.any() else np.zeros(3)
