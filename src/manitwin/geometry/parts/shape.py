"""Shape measurements shared by all feature and part rules: box, long axis and its ends, upright body, opening, handle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh

from manitwin.geometry.boxes import mirror_axis, oriented_bounding_box
from manitwin.geometry.cavity import Opening, find_opening
from manitwin.geometry.parts.arch import Arch, find_arch
from manitwin.geometry.parts.feature_names import HeadEnd
from manitwin.geometry.parts.hooked_end import is_straight_end_last
from manitwin.geometry.parts.outline import SLICES
from manitwin.geometry.parts.pistol import Pistol, find_pistol
from manitwin.geometry.parts.protrusions import Protrusion, RoundBody, round_body
from manitwin.geometry.parts.section_borders import section_borders
from manitwin.geometry.parts.stem import Stem, find_stem
from manitwin.geometry.poses import transform
from manitwin.geometry.ray_caster import local_thickness
from manitwin.geometry.sampling import sample_surface

_SLICES = 32
_DIRECTIONS = 12
_END_SHARE = 0.3  # fraction of the length: end regions that are compared
_DEFAULT_HEAD_SHARE = 0.25  # used if the outline has no step between head and handle
_STEP_CONTRAST = 1.25  # ratio of the wider to the narrower end for a step that can be located


@dataclass(frozen=True)
class LongAxis:
    """The longest axis of the oriented box, from the head (0) to the far end (1).

    ``origin_m (3,)`` is its point at the head, ``direction (3,)`` points away from it, ``across (2, 3)`` are the box's other
    axes, the wider first. ``width_m`` and ``thickness_m`` ``(32,)`` are the outline along it. ``ratio`` is length over width of
    the box, ``head_share`` the position where the head ends, ``center_of_mass_share`` that of the centre of mass.
    """

    origin_m: np.ndarray
    direction: np.ndarray
    across: np.ndarray
    length_m: float
    ratio: float
    width_m: np.ndarray
    thickness_m: np.ndarray
    head_share: float
    center_of_mass_share: float

    def along(self, points_m: np.ndarray) -> np.ndarray:
        """Return the positions of points ``(N, 3)`` along the axis: 0 at the head, 1 at the far end."""
        return (points_m - self.origin_m) @ self.direction / self.length_m

    def off_axis_m(self, points_m: np.ndarray) -> np.ndarray:
        """Return the distance (m) of points ``(N, 3)`` from the axis."""
        return np.linalg.norm((points_m - self.origin_m) @ self.across.T, axis=1)


def long_axis(
    surface_m: np.ndarray,
    obb_extents_m: np.ndarray,
    obb_to_object: np.ndarray,
    center_of_mass_m: np.ndarray,
    head_end: HeadEnd,
) -> LongAxis:
    """Measure the long axis from surface samples ``(N, 3)``; the head, identified by ``head_end``, comes first."""
    order = np.argsort(-obb_extents_m, kind="stable")
    axes = obb_to_object[:3, :3].T[order]
    length = float(obb_extents_m[order[0]])
    local = (surface_m - obb_to_object[:3, 3]) @ axes.T
    share = local[:, 0] / length + 0.5
    width, thickness = _outline(share, local[:, 1:])
    center_share = float((center_of_mass_m - obb_to_object[:3, 3]) @ axes[0] / length + 0.5)
    last = _shorter_is_last(share, local[:, 1:], length) if head_end == "short" else None
    last = is_straight_end_last(share, local[:, 1:]) if head_end == "straight" else last
    if _head_is_last(head_end, width, thickness, center_share, axes[0]) if last is None else last:
        axes[0], width, thickness, center_share = -axes[0], width[::-1], thickness[::-1], 1 - center_share
    return LongAxis(
        origin_m=obb_to_object[:3, 3] - axes[0] * length / 2,
        direction=axes[0],
        across=axes[1:],
        length_m=length,
        ratio=length / max(float(obb_extents_m[order[1]]), 1e-9),
        width_m=width,
        thickness_m=thickness,
        head_share=_head_share(width),
        center_of_mass_share=center_share,
    )


def _outline(share: np.ndarray, across_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return width along the wider cross axis, and thickness, in slices of the long axis, ``(32,)`` each.

    The thickness of a slice is its least extent in any direction, as a tube's flat end may lie diagonally in the box. Empty
    slices repeat the nearest.
    """
    angles = np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS
    directions = np.stack([np.cos(angles), np.sin(angles)])
    index = np.clip((share * _SLICES).astype(int), 0, _SLICES - 1)
    extents = np.full((_SLICES, 2), np.nan)
    for i in range(_SLICES):
        inside = across_m[index == i]
        if len(inside):
            extents[i] = np.ptp(inside[:, 0]), np.ptp(inside @ directions, axis=0).min()
    filled = np.flatnonzero(np.isfinite(extents[:, 0]))
    nearest = filled[np.abs(np.arange(_SLICES)[:, None] - filled[None]).argmin(1)]
    return extents[nearest, 0], extents[nearest, 1]


def _head_is_last(
    rule: HeadEnd, width: np.ndarray, thickness: np.ndarray, center_share: float, axis: np.ndarray
) -> bool:
    count = round(_END_SHARE * _SLICES)
    if rule == "up":
        return bool(axis[2] > 0)
    if rule == "heavy":
        return center_share > 0.5
    profile = width if rule in ("wide", "narrow", "short", "straight") else thickness
    first, last = float(np.mean(profile[:count])), float(np.mean(profile[-count:]))
    return last > first if rule in ("wide", "thick", "short", "straight") else last < first


def _shorter_is_last(share: np.ndarray, across_m: np.ndarray, length_m: float) -> bool | None:
    """Return whether the shorter of two sections comes last; None if there are not exactly two."""
    borders = section_borders(share, across_m, length_m)
    return borders[0][0] > SLICES / 2 if borders is not None and len(borders[0]) == 1 else None


def _head_share(width: np.ndarray) -> float:
    """Return where the width, coming from the head, crosses the mean of its values at the two ends."""
    count = round(_END_SHARE * _SLICES)
    head, handle = float(width[:count].max()), float(np.median(width[-count:]))
    if max(head, handle) < _STEP_CONTRAST * min(head, handle):
        return _DEFAULT_HEAD_SHARE
    halfway = (head + handle) / 2
    beyond = width < halfway if head > handle else width > halfway
    start = int(width[:count].argmax()) if head > handle else 0
    crossing = np.flatnonzero(beyond[start:])
    share = (start + int(crossing[0])) / _SLICES if len(crossing) else _DEFAULT_HEAD_SHARE
    return float(np.clip(share, 0.08, 0.6))


_SAMPLES = 6000
# tolerance within which the smallest box is used, for objects that lean or have a slightly oblique handle
_IN_LINE_DEG = 15.0
# Multiple of the smallest box's volume: above it, the box along the mirror axis is not used (leaning objects)
_MIRRORED_BOX = 1.5
_AT_THE_FOOT = 0.05  # fraction of the body's height
_LOW_BULGE = 0.25  # fraction of the body's radius: least reach for fingers behind a handle
_SIXTH_RAD = np.pi / 6  # to each side of its centre
_OPPOSITE_RAD = np.pi / 6
_AS_FAR = 0.6  # fraction of the opposite one's reach: the axis of a body with two bulges lies between them
LEAST_HANDLE_REACH = 0.08  # fraction of the body's radius, beyond the outline's own margin; less is relief
_TALLER, _STEEPER = 1.1, 2.0  # ratios for a handle beside a long spout: height, height over reach
_ELONGATED, _ELONGATED_LYING = 1.6, 1.15  # ratio of length to width from which an object has ends rather than sides


@dataclass(frozen=True)
class Shape:
    """The measurements of a mesh, shared by all features."""

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
        """The longest side of the oriented box."""
        return float(self.obb_extents_m.max())

    @property
    def side_handle(self) -> Protrusion | None:
        """The bail over an upright body, else the protrusion that can be held: the largest, or a taller and steeper one.

        It is beside the body, which excludes flowers and brushes standing in it. A spout may reach farther than the opposite
        handle but ends in a tip, whereas a handle returns to the body lower down.
        """
        if self.upright and self.body.over is not None:
            return self.body.over
        least_m = LEAST_HANDLE_REACH * self.body.radius_m.max()
        large = [p for p in self.body.protrusions if p.reach_m > least_m and p.low_m < self.body.top_m]
        if not large or not self.upright:
            return None
        first, tallest = large[0], max(large, key=lambda p: p.height_m)
        steeper = tallest.height_m / tallest.reach_m > _STEEPER * first.height_m / first.reach_m
        return tallest if steeper and tallest.height_m > _TALLER * first.height_m else first

    @property
    def added_handle(self) -> Protrusion | None:
        """The side handle; None if it is only the outline of a body that is not round, such as a square glass or a flat bottle.

        Such a bulge starts at the foot of the body, and has a low reach, covers a sixth of the circumference to each side, or
        has a similar one opposite.
        """
        handle = self.side_handle
        if handle is None or handle.bail is not None or handle.low_m > _AT_THE_FOOT * self.body.top_m:
            return handle
        if handle.half_width_rad >= _SIXTH_RAD or handle.reach_m < _LOW_BULGE * self.body.radius_m.max():
            return None
        opposite = [
            each.reach_m
            for each in self.body.protrusions
            if abs(abs(each.azimuth_rad - handle.azimuth_rad) - np.pi) < _OPPOSITE_RAD
        ]
        return None if max(opposite, default=0.0) > _AS_FAR * handle.reach_m else handle

    @property
    def front(self) -> np.ndarray:
        """The direction ``(3,)`` of its large face: along the box's shortest axis, up, or towards -y for a standing object."""
        axis = self.obb_to_object[:3, int(self.obb_extents_m.argmin())]
        leading = axis[2] if abs(axis[2]) > 0.3 else -axis[1] - 0.1 * axis[0]
        return np.asarray(axis if leading > 0 else -axis)

    @cached_property
    def pistol(self) -> Pistol | None:
        """Barrel and grip, if the outline is that of a pistol."""
        return find_pistol(self.surface_m, self.obb_to_object)

    @cached_property
    def arch(self) -> Arch | None:
        """The arch with heavy ends, if any."""
        return find_arch(self.surface_m, self.obb_extents_m, self.obb_to_object, self.center_of_mass_m)

    @cached_property
    def stem(self) -> Stem | None:
        """The one-sided protrusion of a round object, if any."""
        return find_stem(self.surface_m, self.obb_extents_m)

    @property
    def has_ends(self) -> bool:
        """True if the object is elongated, or lies and so is held along its axis."""
        return self.axis.ratio >= (_ELONGATED if self.upright else _ELONGATED_LYING)


@dataclass(frozen=True)
class SurfacePoints:
    """Surface points to be scored: positions ``(N, 3)``, outward normals ``(N, 3)``, material thickness behind them ``(N,)``
    m.
    """

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
    """Measure the oriented box, long axis, upright body and opening of a mesh.

    ``head_end`` identifies the working end of an elongated object. ``stands``: whether such an object stands (its handle is at
    its side) or lies (its handle is an end of its long axis); None: an object that opens upward or is tall stands.
    """
    surface, _, _ = sample_surface(mesh, _SAMPLES, rng)
    extents, obb_to_object = _box(mesh.vertices)
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


def _box(vertices_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the box ``(extents_m (3,), obb_to_object (4, 4))`` along the object's natural axes.

    This is the smallest box, which may lean with the object. If the outline seen from above is mirror-symmetric and the box
    along that axis is little larger, the latter is used: the smallest box of an aircraft is diagonal to hull and wings.
    """
    extents, obb_to_object = oriented_bounding_box(vertices_m)
    along = mirror_axis(vertices_m[:, :2])
    if along is None or _is_in_line(obb_to_object, along):
        return extents, obb_to_object
    axes = np.array([[along[0], along[1], 0.0], [-along[1], along[0], 0.0], [0.0, 0.0, 1.0]])
    local = vertices_m @ axes.T
    low, high = local.min(0), local.max(0)
    if np.prod(high - low) > _MIRRORED_BOX * np.prod(extents):
        return extents, obb_to_object
    return high - low, transform(axes.T, axes.T @ ((low + high) / 2))


def _is_in_line(obb_to_object: np.ndarray, along: np.ndarray) -> bool:
    """Return whether a box axis, seen from above, is parallel or perpendicular to a direction ``(2,)``."""
    flat = obb_to_object[:2, :3]
    length = np.linalg.norm(flat, axis=0)
    sines = np.abs(along[0] * flat[1] - along[1] * flat[0]) / np.maximum(length, 1e-9)
    return bool(sines[length > 0.5].min() < np.sin(np.radians(_IN_LINE_DEG)))


def surface_points(mesh: trimesh.Trimesh, positions_m: np.ndarray, normals: np.ndarray) -> SurfacePoints:
    """Measure the material thickness behind surface points."""
    return SurfacePoints(positions_m, normals, local_thickness(mesh, positions_m, normals))
