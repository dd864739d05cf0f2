"""Scores of surface points for named features such as rim, handle or tip, from the object's shape.

Scores are in [0, 1]; a feature that the shape does not have gives None. Object frame: +Z up, metres.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from manitwin.geometry.parts.asymmetric_features import case, lens, spine, strap, teeth
from manitwin.geometry.parts.feature_names import Feature
from manitwin.geometry.parts.outermost import beam, bow, crest, outlet
from manitwin.geometry.parts.scores import gaussian_falloff as _near
from manitwin.geometry.parts.scores import relative_height as _share_of_height
from manitwin.geometry.parts.shape import LEAST_HANDLE_REACH, Shape, SurfacePoints
from manitwin.geometry.parts.striking_face import handle_direction, handle_line, striking_face


def feature_scores(feature: Feature, shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Return the score of each point for a feature, ``(N,)`` in [0, 1]; None if the shape does not have the feature."""
    scores = _SCORERS[feature](shape, points)
    return None if scores is None else np.clip(scores, 0.0, 1.0)


def _rim(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    opening = shape.opening
    if opening is None:
        return None
    offset = points.positions_m - opening.center_m
    above = offset @ opening.axis
    radial = np.linalg.norm(offset - above[:, None] * opening.axis, axis=1)
    height = _near(above, 0.05 * shape.size_m + 0.02 * opening.depth_m)
    within = np.where(radial < 1.5 * opening.rim_radius_m + 0.01, 1.0, 0.1)
    scores = height * within * (0.4 + 0.6 * _near(np.maximum(points.thickness_m - 0.012, 0), 0.012))
    if shape.side_handle is not None:
        scores = np.where(shape.body.protrusion_mask(points.positions_m, shape.side_handle), 0.1 * scores, scores)
    return scores * np.where(radial > 0.6 * opening.rim_radius_m, 1.0, 0.2)


def _opening(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """The rim on the pouring side, away from the handle."""
    rim = _rim(shape, points)
    return None if rim is None else rim * _away_from_handle(shape, points)


def _mouth(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """The opening if there is one that faces up, else the top, where a lid closes it."""
    rim = _rim(shape, points) if shape.opening is not None and shape.opening.axis[2] > 0.9 else None
    return _top(shape, points) if rim is None else rim


def _away_from_handle(shape: Shape, points: SurfacePoints) -> np.ndarray:
    if shape.side_handle is None or shape.side_handle.bail is not None:
        return np.ones(len(points.positions_m))
    return 0.75 - 0.25 * np.cos(shape.body.azimuth(points.positions_m) - shape.side_handle.azimuth_rad)


_FLAT = 0.5  # of its width: a higher object without an opening is not a plate or tray


def _inside(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    up = points.normals[:, 2]
    if shape.opening is None:
        extents_m = np.ptp(shape.bounds_m, axis=0)
        if extents_m[2] > _FLAT * extents_m[:2].max():
            return None
        radial = np.linalg.norm(points.positions_m[:, :2] - shape.bounds_m[:, :2].mean(0), axis=1)
        return np.maximum(up, 0) * _near(radial, 0.3 * shape.size_m)
    opening = shape.opening
    offset = points.positions_m - opening.center_m
    above = offset @ opening.axis
    radial = np.linalg.norm(offset - above[:, None] * opening.axis, axis=1)
    facing = 0.3 + 0.7 * np.maximum(points.normals @ opening.axis, 0)
    deep = np.clip(-above / opening.depth_m, 0, 1)
    inward = np.einsum("ij,ij->i", points.normals, opening.center_m - points.positions_m) > 0
    return facing * (0.2 + 0.8 * deep) * (radial < 1.05 * opening.rim_radius_m) * inward


def _handle(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    if shape.side_handle is not None:
        mine = shape.body.protrusion_mask(points.positions_m, shape.side_handle)
        if shape.side_handle.bail is not None:  # held at its highest stretch
            return mine * _near(1 - _share_of_height(shape, points), 0.15)
        outside = shape.body.outside_m(points.positions_m) / shape.side_handle.reach_m
        # A ring handle is held in its outer half, a long one (as of a pan) well before its end.
        best = 0.7 if shape.side_handle.reach_m < shape.body.radius_m.max() else 0.35
        return mine * (0.3 + 0.7 * _near(outside - best, 0.35))
    if not shape.has_ends:
        return None
    along = shape.axis.along(points.positions_m)
    held = (1 + 2 * max(shape.axis.head_share, 0.3)) / 3
    return _near(along - held, 0.14) * (along > shape.axis.head_share)


def _handle_end(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    if shape.side_handle is not None and shape.side_handle.bail is not None:
        return _handle(shape, points)
    if shape.side_handle is not None:
        outside = shape.body.outside_m(points.positions_m) / shape.side_handle.reach_m
        return shape.body.protrusion_mask(points.positions_m, shape.side_handle) * _near(outside - 0.9, 0.15)
    if not shape.has_ends:
        return None
    return _near(shape.axis.along(points.positions_m) - 0.95, 0.08)


def _head(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    along = shape.axis.along(points.positions_m)
    share = max(shape.axis.head_share, 0.1)
    broad = 1 - np.abs(points.normals @ shape.axis.direction)
    centered = 0.6 + 0.4 * _near(shape.axis.off_axis_m(points.positions_m), 0.25 * float(shape.axis.width_m.max()))
    return _near(along - 0.55 * share, 0.35 * share) * (0.5 + 0.5 * broad) * centered


_LOPSIDED = 1.25  # how much farther a brush's head extends on the side of the bristles, if they stand out sideways


def _bristles(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """The side of the head that extends farthest from the handle's line, else the front of the head."""
    share = max(shape.axis.head_share, 0.1)
    along = shape.axis.along(points.positions_m)
    head = shape.surface_m[shape.axis.along(shape.surface_m) < share]
    if not len(head):
        return _head(shape, points)
    line, handle = handle_line(shape), handle_direction(shape)
    across = shape.axis.across - np.outer(
        shape.axis.across @ handle, handle
    )  # a bent head tilts the box away from the handle
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    directions = np.concatenate([across, -across])
    reach = ((head - line) @ directions.T).max(0)
    lopsided = reach / np.maximum(np.roll(reach, 2), 1e-9)
    best = int(lopsided.argmax())
    if lopsided[best] < _LOPSIDED:
        return _near(along - 0.3 * share, 0.3 * share)
    out = (points.positions_m - line) @ directions[best]
    facing = 0.6 + 0.4 * points.normals @ directions[best]
    return _near(along - 0.5 * share, 0.4 * share) * np.clip(out / reach[best], 0, 1) ** 2 * facing


def _tip(shape: Shape, points: SurfacePoints) -> np.ndarray:
    return _near(shape.axis.along(points.positions_m), 0.06)


def _edge(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Thin material; on an elongated object, in its working half."""
    thin = _near(np.maximum(points.thickness_m - 0.002, 0), 0.25 * float(np.median(points.thickness_m)) + 0.002)
    if not shape.has_ends:
        return thin
    along = shape.axis.along(points.positions_m)
    return (0.3 + 0.7 * thin) * _near(along - 0.25, 0.15)


def _middle(shape: Shape, points: SurfacePoints) -> np.ndarray:
    along = shape.axis.along(points.positions_m)
    return _near(along - shape.axis.center_of_mass_share, 0.1)


def _neck(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    heights = np.linspace(0, 1, len(shape.body.radius_m))
    upper = (heights > 0.25) & (heights < 0.92)
    narrow = int(np.where(upper, shape.body.radius_m, np.inf).argmin())
    if shape.body.radius_m[narrow] > 0.8 * shape.body.radius_m.max():
        return None
    sideways = 1 - np.abs(points.normals[:, 2])
    return _near(_share_of_height(shape, points) - heights[narrow], 0.08) * (0.4 + 0.6 * sideways)


def _spout(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    others = [p for p in shape.body.protrusions if p is not shape.side_handle]
    high = 0.3 + 0.7 * _share_of_height(shape, points)
    if others and others[0].reach_m > 0.3 * LEAST_HANDLE_REACH * shape.body.radius_m.max():
        return shape.body.protrusion_mask(points.positions_m, others[0]) * high
    rim = _rim(shape, points)
    if rim is None:
        rim = _top(shape, points)
    return np.sqrt(np.maximum(rim, 0)) * _away_from_handle(shape, points) ** 3  # the side matters more than the height


def _top(shape: Shape, points: SurfacePoints) -> np.ndarray:
    facing = 0.6 + 0.4 * points.normals[:, 2]
    handle = shape.side_handle
    if handle is None or handle.bail is None:
        return _near(1 - _share_of_height(shape, points), 0.12) * facing
    low = shape.bounds_m[0, 2]  # the top of the body, below the bail
    below = 1 - (points.positions_m[:, 2] - low) / max(handle.low_m - low, 1e-9)
    beside = ~shape.body.protrusion_mask(points.positions_m, handle) & (shape.body.outside_m(points.positions_m) <= 0)
    return _near(below, 0.12) * facing * beside


def _nozzle(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """The outlet of a pump or trigger that extends to one side; for a round head its whole top."""
    found = outlet(shape, points)
    return _top(shape, points) if found is None else found


def _stem(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """The end of the protrusion of a round object, else its top."""
    stem = shape.stem
    if stem is None:
        return _top(shape, points)
    along = (points.positions_m - stem.center_m) @ stem.direction / stem.reach_m
    return _near(1 - along, 0.12)


def _base(shape: Shape, points: SurfacePoints) -> np.ndarray:
    return _near(_share_of_height(shape, points), 0.08) * (0.4 - 0.6 * points.normals[:, 2])


def _side(shape: Shape, points: SurfacePoints) -> np.ndarray:
    sideways = 1 - np.abs(points.normals[:, 2])
    low, high = shape.bounds_m[:, 2]
    at = (shape.center_of_mass_m[2] - low) / max(high - low, 1e-9)
    radial = points.positions_m[:, :2] - shape.body.axis_xy_m
    outward = np.einsum("ij,ij->i", points.normals[:, :2], radial) > 0
    scores = _near(_share_of_height(shape, points) - at, 0.15) * sideways * np.where(outward, 1.0, 0.2)
    if shape.side_handle is not None:
        scores = np.where(shape.body.protrusion_mask(points.positions_m, shape.side_handle), 0.1 * scores, scores)
    return scores


def _center(shape: Shape, points: SurfacePoints) -> np.ndarray:
    distance = np.linalg.norm(points.positions_m - shape.center_of_mass_m, axis=1)
    return _near(distance, 0.3 * shape.size_m)


def _large_face(shape: Shape, points: SurfacePoints, side: int) -> np.ndarray:
    """The face across the box's shortest axis: first the upper one, or for a standing object the one towards -y."""
    axis = side * shape.front
    offset = points.positions_m - shape.obb_to_object[:3, 3]
    in_plane = np.linalg.norm(offset - (offset @ axis)[:, None] * axis, axis=1)
    return np.maximum(points.normals @ axis, 0) * _near(in_plane, 0.3 * shape.size_m)


def _end(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """The centre of either end of the long axis; for a standing object the upper one scores higher."""
    along = shape.axis.along(points.positions_m)
    middle = _near(shape.axis.off_axis_m(points.positions_m), 0.3 * float(np.sort(shape.obb_extents_m)[1]))
    height = _share_of_height(shape, points)
    return _near(0.5 - np.abs(along - 0.5), 0.08) * (0.8 + 0.2 * height) * (0.7 + 0.3 * middle)


def _toe(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """The end of the long axis away from the foot opening; without an opening the lower end, as the back of a heel stands up."""
    along = shape.axis.along(points.positions_m)
    if shape.opening is not None:
        heel = float(shape.axis.along(shape.opening.center_m[None])[0])
    else:
        heel = float(along[_share_of_height(shape, points) > 0.7].mean())
    front = along if heel < 0.5 else 1 - along
    return _end(shape, points) * (front > 0.5)


def _end_wall(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Sideways surface near an end of the long axis, where fingers hold the end of a box or can."""
    return _end(shape, points) * (1 - np.abs(points.normals[:, 2]))


def _ring(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """The inner side of a ring: surface that faces the centre of the box."""
    toward = shape.obb_to_object[:3, 3] - points.positions_m
    distance = np.linalg.norm(toward, axis=1)
    facing = np.einsum("ij,ij->i", points.normals, toward) / np.maximum(distance, 1e-9)
    return None if facing.max() < 0.5 else np.maximum(facing, 0)


def _muzzle(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """The working end of a pistol's barrel, away from its grip; for other shapes that of the long axis."""
    if shape.pistol is None:
        return _tip(shape, points)
    along, down = shape.pistol.places(points.positions_m)
    return _near(along, 0.07) * _near(np.maximum(np.abs(down - 0.5) - 0.5, 0), 0.1)


def _grip(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    if shape.pistol is None:
        return _handle(shape, points)
    pistol = shape.pistol
    along, down = pistol.places(points.positions_m)
    below = (down - 1) / max(pistol.height_m / pistol.barrel_m - 1, 1e-9)
    return (below > 0) * _near(below - 0.4, 0.25) * _near(along - pistol.grip_share, 0.25)


def _housing(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """The barrel behind its working end, above the grip."""
    if shape.pistol is None:
        return _head(shape, points)
    along, down = shape.pistol.places(points.positions_m)
    return _near(along - 0.65, 0.2) * _near(np.maximum(np.abs(down - 0.4) - 0.4, 0), 0.1)


def _apex(shape: Shape, points: SurfacePoints) -> np.ndarray:
    return _top(shape, points) if shape.arch is None else shape.arch.near_apex(points.positions_m)


def _arch_end(shape: Shape, points: SurfacePoints) -> np.ndarray:
    return _side(shape, points) if shape.arch is None else shape.arch.near_ends(points.positions_m)


_SCORERS: dict[str, Callable[[Shape, SurfacePoints], np.ndarray | None]] = {
    "opening": _opening, "rim": _rim, "inside": _inside, "handle": _handle, "handle_end": _handle_end, "head": _head,
    "face": striking_face, "tip": _tip, "edge": _edge, "middle": _middle, "neck": _neck, "spout": _spout, "top": _top,
    "base": _base, "side": _side, "center": _center, "front": partial(_large_face, side=1),
    "back": partial(_large_face, side=-1), "toe": _toe, "stem": _stem, "nozzle": _nozzle, "crest": crest,
    "end": _end, "ring": _ring,
    "mouth": _mouth, "bristles": _bristles, "muzzle": _muzzle, "grip": _grip, "housing": _housing,
    "apex": _apex, "arch_end": _arch_end, "end_wall": _end_wall, "teeth": teeth, "spine": spine, "case": case,
    "strap": strap, "lens": lens, "bow": bow, "beam": beam,
}  # fmt: skip
