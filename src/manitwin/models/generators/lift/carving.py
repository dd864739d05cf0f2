"""Several matted photos at stated turns to a carved solid: before a camera that stays, or each from the thing's own height."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from manitwin.errors import Rejected
from manitwin.models.generators.lift.carved_solid import Carved
from manitwin.models.generators.lift.hint import ShapeHint
from manitwin.models.generators.lift.level_carving import (
    LEAST_COVERED,
    LEAST_CROSSING,
    carve_level,
    covered_shares,
    level_cost_px,
    placed_outlines,
)
from manitwin.models.generators.lift.pinhole_carving import carve_turned
from manitwin.models.generators.lift.pinhole_hull import covered_shares as covered_by_rays
from manitwin.models.generators.lift.turntable import SIDE_PX, TurntableCamera, calibrated, scaled_masks, sights_of

ROUND_POWER, USUAL_POWER, BOXY_POWER = 2.0, 4.0, 8.0  # of the superellipse at each level (Barr 1981)
LEAST_COVERED_TURNED = 0.95
"""Of each outline, where a camera stays: what is turned before one fills 0.98 and more, photos by hand 0.94 at most."""
_SUSPECTS = 3
_MANY = 5
"""Photos by hand, of so many, explained none of a camera that stays."""
_LEFT_OUT_OF = 4  # photos, at most one that does not go with the others
_ROUNDED_PX = 1.0  # by which sizes of photos that were scaled are off their shape
_LEAST_TURNED = 3
"""Photos from different turns that tell a camera's height, lens and axis; two have too little in common."""


def power_of(hint: ShapeHint) -> float:
    """Return the power of the superellipse that a thing's cross-sections are where only two directions are seen."""
    return ROUND_POWER if hint.round else BOXY_POWER if hint.boxy else USUAL_POWER


def are_crossing(turns_deg: Sequence[float]) -> bool:
    """Tell whether two of the directions differ by enough to say something of the depth; the opposite one says nothing."""
    return bool(np.abs(np.sin(np.deg2rad(np.subtract.outer(turns_deg, turns_deg)))).max() >= LEAST_CROSSING)


def carve(
    photos: Sequence[tuple[str, np.ndarray]],
    turns_deg: Sequence[float],
    *,
    power: float = USUAL_POWER,
    focal_mm: float | None = None,
) -> Carved:
    """Carve what matted ``photos`` (name, ``(H, W, 4) uint8``) show from ``turns_deg`` about the vertical, counter-clockwise.

    Three and more photos of one shape may be of a thing that is turned before a camera that stays, at any height, or of a camera
    that goes round it at one height and distance: the outlines tell it. Else each is from about the thing's own height.
    ``power`` is that of the superellipse at each level where only two directions are seen; ``focal_mm`` is the lens as 35 mm
    equivalent, where it is stated. Of six photos and more before a camera that stays, at most a quarter is left out where the
    others go together without them. Raises Rejected ``generator_failed`` naming the photo that does not go with the others.
    """
    sized = _of_one_size(photos)
    if not _may_be_turned(sized, turns_deg):
        return _carved_level(photos, turns_deg, power)
    photos = sized
    pictures = [rgba for _, rgba in photos]
    camera, covered, without = _seen_turned(pictures, turns_deg, focal_mm)
    fits = min(covered) >= LEAST_COVERED_TURNED
    if fits and len(photos) >= _MANY:
        return carve_turned(photos, turns_deg, camera, covered, power)
    outlines = placed_outlines(photos, turns_deg)
    level = min(covered_shares(outlines)) >= LEAST_COVERED
    # three leave lens and height open; where level ones explain them as well, these are nearer to the truth
    doubted = level and (len(photos) <= _LEAST_TURNED or level_cost_px(outlines, SIDE_PX) < camera.cost_px)
    if fits and not doubted:
        return carve_turned(photos, turns_deg, camera, covered, power)
    if level:
        return carve_level(outlines, power)
    kept = _going_together(photos, turns_deg, focal_mm, without)
    if kept is not None:
        left = tuple(name for k, (name, _) in enumerate(photos) if k not in kept)
        some, turns = [photos[k] for k in kept], [turns_deg[k] for k in kept]
        return replace(carve(some, turns, power=power, focal_mm=focal_mm), left_out=left)
    raise Rejected("generator_failed", _told(photos, turns_deg, focal_mm, covered, without), "generate")


def _going_together(
    photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float], focal_mm: float | None, without: np.ndarray
) -> list[int] | None:
    """Return the photos that go together once the few are left out that do not; None where these would be too many."""
    kept = list(range(len(photos)))
    for _ in range(min(len(photos) // _LEFT_OUT_OF, len(photos) - _MANY)):
        # the one without which the others are filled most
        filled = [float(np.delete(without[:, k], k).mean()) for k in range(len(kept))]
        kept.pop(int(np.argmax(filled)))
        turns = [turns_deg[k] for k in kept]
        if not are_crossing(turns) or not _may_be_turned([photos[k] for k in kept], turns):
            return None
        _, covered, without = _seen_turned([photos[k][1] for k in kept], turns, focal_mm)
        if min(covered) >= LEAST_COVERED_TURNED:
            return kept
    return None


def _carved_level(photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float], power: float) -> Carved:
    """Carve photos of several shapes; where they are refused and few have another shape than the rest, these are named."""
    try:
        return carve_level(placed_outlines(photos, turns_deg), power)
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


def _of_one_size(photos: Sequence[tuple[str, np.ndarray]]) -> Sequence[tuple[str, np.ndarray]]:
    """Return photos of one shape in the size of the smallest: what was scaled since still shows what the camera saw."""
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


def _may_be_turned(photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float]) -> bool:
    sizes = {rgba.shape[:2] for _, rgba in photos}
    return len(sizes) == 1 and len({round(turn % 360.0) for turn in turns_deg}) >= _LEAST_TURNED


def _seen_turned(
    pictures: Sequence[np.ndarray], turns_deg: Sequence[float], focal_mm: float | None
) -> tuple[TurntableCamera, list[float], np.ndarray]:
    camera = calibrated(pictures, turns_deg, focal_mm)
    return camera, *covered_by_rays(sights_of(scaled_masks(pictures, SIDE_PX), camera, turns_deg))


def _told(
    photos: Sequence[tuple[str, np.ndarray]],
    turns_deg: Sequence[float],
    focal_mm: float | None,
    covered: Sequence[float],
    without: np.ndarray,
) -> str:
    """Say why the outlines do not go together: turned the other way round, one of them, or none of these."""
    _, turned_back, _ = _seen_turned([rgba for _, rgba in photos], [-turn for turn in turns_deg], focal_mm)
    if min(turned_back) >= LEAST_COVERED_TURNED:
        return (
            "the outlines are of one thing where the turns are counted the other way round; a turntable that turns"
            " counter-clockwise, seen from above, turns the camera clockwise about the thing: state -90 for its first quarter"
        )
    names = [name for name, _ in photos]
    remedy = "check its turn (degrees, counter-clockwise from above) and that it shows the whole of the same object"
    other = _another(photos, turns_deg, focal_mm, without)
    if other is not None:
        return f"{names[other]}: its outline does not match those of the other photos; {remedy}, or leave it out"
    least = int(np.argmin(covered))
    return (
        f"these {len(names)} outlines are not of one object at these turns (their hull fills {covered[least]:.0%}"
        f" of that of"
        f" {names[least]}); check the turns (degrees, counter-clockwise from above), and take all photos uncropped from one place"
        " while the thing is turned, or each from the thing's own height"
    )


def _another(
    photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float], focal_mm: float | None, without: np.ndarray
) -> int | None:
    """Return the photo without which all others go together best; None where they do so without none."""
    others = [float(np.delete(without[:, k], k).min()) for k in range(len(photos))]
    likely = sorted(range(len(photos)), key=lambda k: -others[k])[:_SUSPECTS]
    found = []
    for k in likely:
        rest, turns = [*photos[:k], *photos[k + 1 :]], [*turns_deg[:k], *turns_deg[k + 1 :]]
        if _may_be_turned(rest, turns):
            camera, covered, _ = _seen_turned([rgba for _, rgba in rest], turns, focal_mm)
            if min(covered) >= LEAST_COVERED_TURNED:
                found.append((camera.cost_px, k))
    return min(found)[1] if found else None
