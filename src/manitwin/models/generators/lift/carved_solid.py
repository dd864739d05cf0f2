"""Solid as a level set of a scalar field, in its resting pose, with the photos it was carved from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from manifold3d import Manifold

from manitwin.errors import Rejected
from manitwin.models.generators.lift.surface import (
    LiftedSurface,
    cut_standing_base,
    from_manifold,
    normalised,
    to_manifold,
)
from manitwin.models.generators.lift.texture import Crop

SIMPLER_CELLS = 0.15  # tolerance of mesh simplification, in cells
BASE_CUTS = (0.0, 0.01, 0.02, 0.04, 0.06, 0.1)
LEAST_TIP_DEG = 5.0


class CarvingPhoto(Protocol):
    """One of the photos that a solid is carved from.

    Points ``(N, 3)`` have x to the first photo's right, y up, and z towards its camera, before the solid is put into its
    resting pose.
    """

    @property
    def name(self) -> str:
        """Name of the file."""

    @property
    def turn_deg(self) -> float:
        """Rotation of the camera about the vertical, counter-clockwise."""

    @property
    def crop(self) -> Crop:
        """Crop of the photo around the object."""

    def crop_share(self, points: np.ndarray) -> np.ndarray:
        """Return the positions ``(N, 2)`` of points in the crop, 0 to 1 to the right and down."""

    def camera_directions(self, points: np.ndarray) -> np.ndarray:
        """Return the unit vectors ``(N, 3)`` from points to the camera."""


@dataclass(frozen=True)
class CarvedSolid:
    """A solid carved from several photos, in its resting pose, longest side 1 (see ``LiftedObject``).

    ``covered`` is the share of each silhouette that the solid fills. ``to_carved (4, 4)`` transforms points of the surface to
    the frame and unit of the carving. ``camera`` has the estimated parameters of a fixed camera before a turntable; None if
    the photos were taken to be level with the object. ``left_out`` names photos whose silhouettes are inconsistent with the
    others.
    """

    surface: LiftedSurface
    photos: tuple[CarvingPhoto, ...]
    covered_shares: tuple[float, ...]
    to_carved: np.ndarray
    camera: dict[str, float] | None = None
    left_out: tuple[str, ...] = ()


def carved_solid_from_field(
    field: np.ndarray,
    cell: float,
    origin: np.ndarray,
    outlines: Sequence[CarvingPhoto],
    covered: Sequence[float],
    camera: dict[str, float] | None = None,
    base_cuts: tuple[float, ...] = BASE_CUTS,
) -> CarvedSolid:
    """Return the solid where ``field`` (X, Y, Z; x right, y away, z up) is positive, in its resting pose.

    ``cell`` is the spacing of the field and ``origin (3,)`` its first node, in the unit of the carving. ``base_cuts`` are the
    shares of the height that may be cut off so that the solid stands. Raises Rejected if the solid is empty.
    """
    mesh = _level_set(field, cell, origin).to_mesh()
    vertices = np.asarray(mesh.vert_properties, float)[:, :3]
    # the lifted frame: x right, y up, z towards the viewer
    frame = vertices[:, [0, 2, 1]] * [1, 1, -1]
    empty = np.zeros((len(vertices), 2)), np.zeros(len(vertices))
    surface = from_manifold(to_manifold(LiftedSurface(frame, np.asarray(mesh.tri_verts, np.int64), *empty)))
    standing = cut_standing_base(surface, LEAST_TIP_DEG, base_cuts) or surface
    rest = normalised(standing)
    low, high = standing.vertices.min(axis=0), standing.vertices.max(axis=0)
    size = float((high - low).max())
    to_carved = np.diag([size, size, size, 1.0])
    to_carved[:3, 3] = (low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2
    return CarvedSolid(rest, tuple(outlines), tuple(round(share, 4) for share in covered), to_carved, camera)


def _level_set(field: np.ndarray, cell: float, origin: np.ndarray) -> Manifold:
    """Return the solid where ``field`` (X, Y, Z) is positive; raises Rejected if it is empty."""
    solid = Manifold.level_set(field_interpolator(field, cell, origin), _bounds(field, cell, origin), 1.3 * cell)
    solid = solid.simplify(SIMPLER_CELLS * cell)
    if solid.is_empty():
        raise Rejected("generator_failed", "the outlines do not intersect; check the turns", "generate")
    return solid


def _bounds(field: np.ndarray, cell: float, origin: np.ndarray) -> list[float]:
    low = [float(each) for each in origin]
    return [*low, *(start + (count - 1) * cell for start, count in zip(low, field.shape, strict=True))]


def field_interpolator(field: np.ndarray, cell: float, origin: np.ndarray) -> Callable[[float, float, float], float]:
    """Return a function that interpolates a field (X, Y, Z) trilinearly, with the value ``-cell`` outside.

    ``cell`` is the spacing of the field and ``origin (3,)`` its first node. Manifold evaluates millions of points,
    alternating between two lines along z, so the last two lines, interpolated in x and y, are cached.
    """
    values = field.astype(np.float64)
    nx, ny, nz = field.shape
    x0, y0, z0 = (float(each) for each in origin)
    outside = [-cell] * nz
    last = nz - 1

    def along_z(x: float, y: float) -> list[float]:
        i, j = (x - x0) / cell, (y - y0) / cell
        a, b = int(i), int(j)
        if i < 0 or j < 0 or a >= nx - 1 or b >= ny - 1:
            return outside
        i, j = i - a, j - b
        near, far = values[a], values[a + 1]
        between = (near[b] * (1 - j) + near[b + 1] * j) * (1 - i) + (far[b] * (1 - j) + far[b + 1] * j) * i
        return list(between.tolist())

    newer_x = newer_y = older_x = older_y = np.nan
    newer = older = outside

    def at(x: float, y: float, z: float) -> float:
        nonlocal newer_x, newer_y, newer, older_x, older_y, older
        if x == newer_x and y == newer_y:
            column = newer
        elif x == older_x and y == older_y:
            column = older
        else:
            older_x, older_y, older = newer_x, newer_y, newer
            newer_x, newer_y = x, y
            column = newer = along_z(x, y)
        k = (z - z0) / cell
        if k < 0 or k >= last:
            return -cell
        c = int(k)
        k -= c
        return column[c] * (1 - k) + column[c + 1] * k

    return at
