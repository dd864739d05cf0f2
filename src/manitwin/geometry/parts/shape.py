"""What is measured of a thing once, so that its parts can be found: box, long axis, upright body, opening, handle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from manitwin.geometry.boxes import oriented_bounding_box
from manitwin.geometry.cavity import Opening, find_opening
from manitwin.geometry.parts.elongation import HeadEnd, LongAxis, long_axis
from manitwin.geometry.parts.local_thickness import local_thickness
from manitwin.geometry.parts.protrusions import Protrusion, RoundBody, round_body
from manitwin.geometry.sampling import sample_surface

_SAMPLES = 6000
LEAST_HANDLE_REACH = 0.08  # of the body's radius, beyond the outline's own margin: less is relief, no handle
_ELONGATED, _ELONGATED_LYING = 1.6, 1.15  # length by width from which a thing has ends rather than sides


@dataclass(frozen=True)
class Shape:
    """What was measured of a mesh, once for all features."""

    surface_m: np.ndarray
    bounds_m: np.ndarray
    obb_extents_m: np.ndarray
    obb_to_object: np.ndarray
    center_of_mass_m: np.ndarray
    axis: LongAxis
    body: RoundBody
    opening: Opening | None
    upright: bool

    @property
    def size_m(self) -> float:
        """The longest axis of the oriented box."""
        return float(self.obb_extents_m.max())

    @property
    def side_handle(self) -> Protrusion | None:
        """The largest thing that sticks out of an upright body, if it is large enough to be held."""
        for protrusion in self.body.protrusions if self.upright else ():
            if protrusion.reach_m > LEAST_HANDLE_REACH * self.body.radius_m.max():
                return protrusion
        return None

    @property
    def has_ends(self) -> bool:
        """Whether it is long, or lies and so is held along its axis."""
        return self.axis.ratio >= (_ELONGATED if self.upright else _ELONGATED_LYING)


@dataclass(frozen=True)
class SurfacePoints:
    """Surface points to be scored: positions ``(N, 3)``, outward normals ``(N, 3)``, matter behind them ``(N,)`` m."""

    positions_m: np.ndarray
    normals: np.ndarray
    thickness_m: np.ndarray


def measure_shape(
    mesh: trimesh.Trimesh,
    center_of_mass_m: np.ndarray,
    head_end: HeadEnd,
    stands: bool | None,
    rng: np.random.Generator,
) -> Shape:
    """Measure what the features need: oriented box, long axis, upright body and opening.

    ``head_end`` tells the working end of a long thing; ``stands`` whether such a thing stands (its handle is at its
    side) or lies (its handle is an end of its long axis); None: what opens upward or is tall stands.
    """
    surface, _, _ = sample_surface(mesh, _SAMPLES, rng)
    extents, obb_to_object = oriented_bounding_box(mesh.vertices)
    opening = find_opening(mesh)
    opens_upward = opening is not None and bool(opening.axis[2] > 0.9)
    tall = bool(mesh.extents[2] > 0.5 * extents.max())
    return Shape(
        surface_m=surface,
        bounds_m=mesh.bounds,
        obb_extents_m=extents,
        obb_to_object=obb_to_object,
        center_of_mass_m=np.asarray(center_of_mass_m, dtype=float),
        axis=long_axis(surface, extents, obb_to_object, center_of_mass_m, head_end),
        body=round_body(surface, opening.center_m[:2] if opening is not None and opens_upward else None),
        opening=opening,
        upright=opens_upward or tall if stands is None else stands,
    )


def surface_points(mesh: trimesh.Trimesh, positions_m: np.ndarray, normals: np.ndarray) -> SurfacePoints:
    """Measure the thickness behind points of the surface."""
    return SurfacePoints(positions_m, normals, local_thickness(mesh, positions_m, normals))
