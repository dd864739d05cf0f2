"""Types of functional frames, and the mesh with cached measurements on which frames are computed."""

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
_LOCAL_SAMPLES, _MOST_LOCAL_SAMPLES = 500, 200_000  # per circle of the query radius


@dataclass(frozen=True)
class FeatureFrame:
    """The frame of a feature in the object frame: ``position_m (3,)``, and ``rotation (3, 3)`` with the columns X, Y, Z.

    Z is the functional direction and X the secondary direction. ``size_m`` is a radius, for edges and axes the length.
    ``roll_free``: any rotation about Z is equivalent.
    """

    kind: Kind
    position_m: np.ndarray
    rotation: np.ndarray
    size_m: float
    roll_free: bool

    @property
    def z(self) -> np.ndarray:
        """The functional direction Z, ``(3,)``."""
        return self.rotation[:, 2]

    @property
    def x(self) -> np.ndarray:
        """The secondary direction X, ``(3,)``."""
        return self.rotation[:, 0]


@dataclass(frozen=True)
class NoFrame:
    """The reason why there is no frame, as a completion of 'no frame: ...'."""

    reason: str


Found = FeatureFrame | NoFrame


def rotation_of(z: np.ndarray, x: np.ndarray = UP) -> np.ndarray:
    """Return the rotation ``(3, 3)`` with its third column along ``z (3,)`` and its first as close to ``x (3,)`` as possible.

    If both are parallel, the first column is as close to the object's X (or Y) as possible.
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
    """A watertight mesh in the object frame, with measurements that are shared by all frames and computed on first use.

    ``seed`` is that of the surface samples; ``known_opening`` avoids searching for a known opening.
    """

    mesh: trimesh.Trimesh
    center_of_mass_m: np.ndarray
    seed: int = 0
    known_opening: Opening | None = field(default=None)

    @cached_property
    def size_m(self) -> float:
        """The longest side of the axis-aligned box, m."""
        return float(self.mesh.extents.max())

    @cached_property
    def caster(self) -> RayCaster:
        """A ray caster for the mesh."""
        return RayCaster(self.mesh)

    @cached_property
    def opening(self) -> Opening | None:
        """The largest cavity that would hold water."""
        return self.known_opening or find_opening(self.mesh)

    @cached_property
    def samples(self) -> tuple[np.ndarray, np.ndarray]:
        """Surface samples: positions ``(6000, 3)`` m and face normals ``(6000, 3)``."""
        positions, normals, _ = sample_surface(self.mesh, _SAMPLES, np.random.default_rng(self.seed))
        return positions, normals

    @cached_property
    def tree(self) -> cKDTree:
        """A k-d tree of the positions in ``samples``."""
        return cKDTree(self.samples[0])

    @cached_property
    def corners(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The faces with coincident vertices merged ``(F, 3)``, their centres and normals ``(F, 3)`` and areas ``(F,)`` m2."""
        _, joined = np.unique(np.round(self.mesh.vertices, 7), axis=0, return_inverse=True)
        faces = joined.reshape(-1)[self.mesh.faces]
        return faces, self.mesh.triangles_center, np.asarray(self.mesh.face_normals), self.mesh.area_faces

    @cached_property
    def spacing_m(self) -> float:
        """The mean distance between neighbouring samples."""
        return float(np.sqrt(self.mesh.area / _SAMPLES))

    def body(self, axis_xy_m: np.ndarray | None) -> RoundBody:
        """Return the upright body about a vertical axis, with its protrusions."""
        return round_body(self.samples[0], axis_xy_m)

    def near(self, point_m: np.ndarray, radius_m: float) -> np.ndarray:
        """Return the indices of the samples within a radius of a point."""
        return np.array(sorted(self.tree.query_ball_point(point_m, radius_m)), dtype=int)

    def mean_normal(self, point_m: np.ndarray, normal: np.ndarray, radius_m: float) -> np.ndarray:
        """Return the area-weighted mean ``(3,)`` of the unit normals within a radius of a point, on its side; its length shows
        uniformity.

        New samples are drawn from the faces near the point, as the global samples are too sparse for thin parts.
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
