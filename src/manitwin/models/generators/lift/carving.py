"""Carving of a solid from several matted photos at stated turns: with a fixed camera, or with level views."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from manitwin.errors import Rejected
from manitwin.models.generators.lift.carved_solid import CarvedSolid
from manitwin.models.generators.lift.hint import ShapeHint
from manitwin.models.generators.lift.level_carving import (
    LEAST_COVERED,
    LEAST_CROSSING,
    carve_level,
    covered_shares,
    level_cost_px,
    place_silhouettes,
)
from manitwin.models.generators.lift.pinhole_carving import carve_turntable
from manitwin.models.generators.lift.pinhole_hull import covered_shares as covered_by_rays
from manitwin.models.generators.lift.turntable import (
    SIDE_PX,
    TurntableCamera,
    calibrate_turntable,
    pinhole_silhouettes,
    scaled_masks,
)

ROUND_POWER, USUAL_POWER, BOXY_POWER = 2.0, 4.0, 8.0  # exponents of the superellipse at each level (Barr 1981)
LEAST_COVERED_TURNTABLE = 0.95
"""Minimum share of each silhouette that the solid fills with a fixed camera.

Turntable photos reach 0.98 and more, handheld photos 0.94 at most.
"""
_SUSPECTS = 3
_MANY = 5
"""Number of photos from which a consistent turntable camera is trusted: no set of this many handheld photos fits one."""
_PHOTOS_PER_OUTLIER = 4  # at most one of this many photos may be inconsistent with the others
_ROUNDED_PX = 1.0  # tolerance for rounded sizes of scaled photos
_LEAST_TURNED = 3
"""Minimum number of different turns that determine a camera's height, focal length and axis; two have too little in common."""


def superellipse_power(hint: ShapeHint) -> float:
    """Return the exponent of the superellipse of an object's cross-sections, used if only two directions are seen."""
    return ROUND_POWER if hint.round else BOXY_POWER if hint.boxy else USUAL_POWER


def are_crossing(turns_deg: Sequence[float]) -> bool:
    """Tell whether two of the directions differ enough to determine the depth; an opposite direction adds nothing."""
    return bool(np.abs(np.sin(np.deg2rad(np.subtract.outer(turns_deg, turns_deg)))).max() >= LEAST_CROSSING)


def carve(
    photos: Sequence[tuple[str, np.ndarray]],
    turns_deg: Sequence[float],
    *,
    power: float = USUAL_POWER,
    focal_mm: float | None = None,
) -> CarvedSolid:
    """Carve a solid from matted ``photos`` (name, ``(H, W, 4) uint8``) seen from ``turns_deg``, counter-clockwise.

    Three and more photos of the same size may show an object that turns before a fixed camera at any height, or come from a
    camera moved around it at constant height and distance; the silhouettes tell whether they do. Otherwise each photo is
    taken to be level with the object. ``power`` is the exponent of the superellipse at each level if only two directions are
    seen; ``focal_mm`` is the 35 mm equivalent focal length, if stated. Of six and more photos with a fixed camera up to a
    quarter is left out if the others are consistent without them. Raises Rejected ``generator_failed`` naming the
    inconsistent photo.
    """
    sized = _scale_to_smallest(photos)
    if not _may_be_turntable(sized, turns_deg):
        return _carve_level_views(photos, turns_deg, power)
    photos = sized
    pictures = [rgba for _, rgba in photos]
    camera, covered, without = _calibrate_and_cover(pictures, turns_deg, focal_mm)
    fits = min(covered) >= LEAST_COVERED_TURNTABLE
    if fits and len(photos) >= _MANY:
        return carve_turntable(photos, turns_deg, camera, covered, power)
    outlines = place_silhouettes(photos, turns_deg)
    level = min(covered_shares(outlines)) >= LEAST_COVERED
    # three photos do not determine focal length and height well; level views are preferred if they also explain them
    doubted = level and (len(photos) <= _LEAST_TURNED or level_cost_px(outlines, SIDE_PX) < camera.cost_px)
    if fits and not doubted:
        return carve_turntable(photos, turns_deg, camera, covered, power)
    if level:
        return carve_level(outlines, power)
    kept = _consistent_subset(photos, turns_deg, focal_mm, without)
    if kept is not None:
        left = tuple(name for k, (name, _) in enumerate(photos) if k not in kept)
        some, turns = [photos[k] for k in kept], [turns_deg[k] for k in kept]
        return replace(carve(some, turns, power=power, focal_mm=focal_mm), left_out=left)
    raise Rejected(
        "generator_failed", _describe_inconsistency(photos, turns_deg, focal_mm, covered, without), "generate"
    )


def _consistent_subset(
    photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float], focal_mm: float | None, without: np.ndarray
) -> list[int] | None:
    """Return the photos that are consistent after leaving a few out; None if too many would be left out."""
    kept = list(range(len(photos)))
    for _ in range(min(len(photos) // _PHOTOS_PER_OUTLIER, len(photos) - _MANY)):
        # remove the photo without which the others are covered best
        filled = [float(np.delete(without[:, k], k).mean()) for k in range(len(kept))]
        kept.pop(int(np.argmax(filled)))
        turns = [turns_deg[k] for k in kept]
        if not are_crossing(turns) or not _may_be_turntable([photos[k] for k in kept], turns):
            return None
        _, covered, without = _calibrate_and_cover([photos[k][1] for k in kept], turns, focal_mm)
        if min(covered) >= LEAST_COVERED_TURNTABLE:
            return kept
    return None


def _carve_level_views(
    photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float], power: float
) -> CarvedSolid:
    """Carve photos of different sizes as level views; if that fails and a few have a deviating size, the error names them."""
    try:
        return carve_level(place_silhouettes(photos, turns_deg), power)
    except Rejected as error:
        shapes = [rgba.shape[:2] for _, rgba in photos]
        height, width = max(shapes, key=shapes.count)
        odd = [name for (name, _), shape in zip(photos, shapes, strict=True) if shape != (height, width)]
        if not odd or 2 * len(odd) >= len(photos):
            raise
        told = (
            f"{', '.join(odd)}: not of the shape of the other photos, {width} x {height} pixels: of a thing that is turned"
            " before a camera, give all uncropped"
        )
        raise Rejected(error.reason, f"{told}; {error.detail}", error.stage) from error


def _scale_to_smallest(photos: Sequence[tuple[str, np.ndarray]]) -> Sequence[tuple[str, np.ndarray]]:
    """Return photos of the same aspect ratio scaled to the smallest size; scaling does not change the field of view."""
    height, width = min((rgba.shape[:2] for _, rgba in photos), key=lambda shape: shape[0] * shape[1])
    for _, rgba in photos:
        scale = rgba.shape[1] / width
        if abs(rgba.shape[0] - scale * height) > _ROUNDED_PX * max(scale, 1.0):
            return photos
    return [
        (
            name,
            rgba
            if rgba.shape[:2] == (height, width)
            else cv2.resize(rgba, (width, height), interpolation=cv2.INTER_AREA),
        )
        for name, rgba in photos
    ]


def _may_be_turntable(photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float]) -> bool:
    sizes = {rgba.shape[:2] for _, rgba in photos}
    return len(sizes) == 1 and len({round(turn % 360.0) for turn in turns_deg}) >= _LEAST_TURNED


def _calibrate_and_cover(
    pictures: Sequence[np.ndarray], turns_deg: Sequence[float], focal_mm: float | None
) -> tuple[TurntableCamera, list[float], np.ndarray]:
    camera = calibrate_turntable(pictures, turns_deg, focal_mm)
    return camera, *covered_by_rays(pinhole_silhouettes(scaled_masks(pictures, SIDE_PX), camera, turns_deg))


def _describe_inconsistency(
    photos: Sequence[tuple[str, np.ndarray]],
    turns_deg: Sequence[float],
    focal_mm: float | None,
    covered: Sequence[float],
    without: np.ndarray,
) -> str:
    """Return why the silhouettes are inconsistent: reversed turns, a single photo, or unknown."""
    _, turned_back, _ = _calibrate_and_cover([rgba for _, rgba in photos], [-turn for turn in turns_deg], focal_mm)
    if min(turned_back) >= LEAST_COVERED_TURNTABLE:
        return (
            "the outlines are of one thing where the turns are counted the other way round; a turntable that turns"
            " counter-clockwise, seen from above, turns the camera clockwise about the thing: state -90 for its first quarter"
        )
    names = [name for name, _ in photos]
    remedy = "check its turn (degrees, counter-clockwise from above) and that it shows the whole of the same object"
    other = _find_outlier(photos, turns_deg, focal_mm, without)
    if other is not None:
        return f"{names[other]}: its outline does not match those of the other photos; {remedy}, or leave it out"
    least = int(np.argmin(covered))
    return (
        f"these {len(names)} outlines are not of one object at these turns (their hull fills {covered[least]:.0%}"
        f" of that of"
        f" {names[least]}); check the turns (degrees, counter-clockwise from above), and take all photos uncropped from one place"
        " while the thing is turned, or each from the thing's own height"
    )


def _find_outlier(
    photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float], focal_mm: float | None, without: np.ndarray
) -> int | None:
    """Return the index of the photo without which all others are most consistent; None if there is none."""
    others = [float(np.delete(without[:, k], k).min()) for k in range(len(photos))]
    likely = sorted(range(len(photos)), key=lambda k: -others[k])[:_SUSPECTS]
    found = []
    for k in likely:
        rest, turns = [*photos[:k], *photos[k + 1 :]], [*turns_deg[:k], *turns_deg[k + 1 :]]
        if _may_be_turntable(rest, turns):
            camera, covered, _ = _calibrate_and_cover([rgba for _, rgba in rest], turns, focal_mm)
            if min(covered) >= LEAST_COVERED_TURNTABLE:
                found.append((camera.cost_px, k))
    return min(found)[1] if found else None
