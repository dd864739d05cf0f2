"""Carving of a solid from photos with stated camera poses at any distance and height: the solid within all silhouettes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from manitwin.errors import Rejected
from manitwin.formats.camera_poses.posed_camera import PosedCamera
from manitwin.models.generators.lift.carved_solid import CarvedSolid, carved_solid_from_field
from manitwin.models.generators.lift.pinhole import PinholeSilhouette, bounding_sphere
from manitwin.models.generators.lift.pinhole_carving import MASK_PX
from manitwin.models.generators.lift.pinhole_hull import covered_shares, ground_level, hull_field
from manitwin.models.generators.lift.posed_conventions import LEAST_COVERED, describe_inconsistency
from manitwin.models.generators.lift.posed_photos import PosedCarvingPhoto, PosedPhoto, to_carving_frame
from manitwin.models.generators.lift.texture import crop_object
from manitwin.models.generators.lift.turntable import SIDE_PX as ROUGH_SIDE_PX

SIDE_PX, CELLS = 640, 160
"""Longest side of the silhouettes' bounding boxes, and grid cells along the solid's longest side.

Measured poses are more accurate than poses estimated from silhouettes, so the resolution is higher; 96 cells lost a sixteenth
of a tapered tail.
"""
LEAST_CROSSING = 0.3
"""Minimum sine of the largest angle between the directions of two cameras; below it they show the same."""
_MANY, _LEFT_OUT_OF = 6, 4  # from this many photos on, one in four may be inconsistent with the others
_BELOW_DEG, _LOW_DEG = -10.0, 15.0
"""Cameras below the first elevation see the underside; only cameras within the second of the lowest determine the ground."""
_BASE_CUTS = (0.0, 0.01, 0.02)  # of the height: with measured lengths, base cuts stay within the measurement error


def carve_posed(
    photos: Sequence[tuple[str, np.ndarray]], cameras: Sequence[PosedCamera], turns_deg: Sequence[float]
) -> tuple[CarvedSolid, float]:
    """Carve a solid from matted photos (name, ``(H, W, 4) uint8``); return it and the length of its unit in the poses' unit.

    The world frame of the cameras has z up; ``turns_deg`` are their rotations about it, 0 for the first. Of six and more
    photos up to a quarter is left out if the others are consistent without them. Raises Rejected ``generator_failed`` if all
    cameras are in one direction, and if poses and silhouettes are inconsistent, naming the photos, or the convention in which
    they are consistent.
    """
    posed, unit = to_carving_frame(photos, cameras, turns_deg)
    rough = [photo.pinhole_silhouette(ROUGH_SIDE_PX)[0] for photo in posed]
    kept, covered = _consistent_subset(posed, rough, lambda *found: describe_inconsistency(photos, cameras, *found))
    left_out = tuple(photo.name for number, photo in enumerate(posed) if number not in kept)
    posed = [posed[number] for number in kept]
    _require_crossing([rough[number] for number in kept])
    sights = [photo.pinhole_silhouette(SIDE_PX)[0] for photo in posed]
    field, cell, origin = hull_field(sights, None, _ground(sights), CELLS)
    seen = [PosedCarvingPhoto(each.name, each.turn_deg, crop_object(each.rgba, MASK_PX), each) for each in posed]
    carved = replace(
        carved_solid_from_field(field, cell, origin, seen, covered, base_cuts=_BASE_CUTS), left_out=left_out
    )
    return carved, float(carved.to_carved[0, 0]) / unit


def _consistent_subset(
    posed: Sequence[PosedPhoto], sights: Sequence[PinholeSilhouette], told: Callable[[Sequence[float], np.ndarray], str]
) -> tuple[list[int], list[float]]:
    """Return the photos that are consistent after leaving a few out, and the covered share of each silhouette."""
    kept = list(range(len(posed)))
    first = covered, without = covered_shares(sights)
    most = len(posed) // _LEFT_OUT_OF if len(posed) >= _MANY else 0
    while min(covered) < LEAST_COVERED:
        if len(posed) - len(kept) >= most:
            raise Rejected("generator_failed", told(*first), "generate")
        # remove the photo without which the others are covered best
        filled = [float(np.delete(without[:, k], k).mean()) for k in range(len(kept))]
        kept.pop(int(np.argmax(filled)))
        covered, without = covered_shares([sights[number] for number in kept])
    return kept, covered


def _require_crossing(sights: Sequence[PinholeSilhouette]) -> None:
    """Raise Rejected if all cameras look from the same or the opposite direction."""
    centre, _ = bounding_sphere(sights)
    toward = np.array([sight.position - centre for sight in sights])
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    sines = np.linalg.norm(np.cross(toward[:, None], toward[None]), axis=2)
    if sines.max() < LEAST_CROSSING:
        raise Rejected(
            "generator_failed",
            f"all {len(sights)} cameras are in one direction from the object, or the opposite one, so their"
            f" outlines do not show the depth; add a photo from the side",
            "generate",
        )


def _ground(sights: Sequence[PinholeSilhouette]) -> float:
    """Return the height of the ground; minus infinity if some cameras look up at the object and see its lower end.

    Cameras high above see bulges instead of the ground, so only the lowest ones are used.
    """
    centre, _ = bounding_sphere(sights)
    heights = []
    for sight in sights:
        toward = sight.position - centre
        heights.append(float(np.rad2deg(np.arctan2(toward[2], np.hypot(toward[0], toward[1])))))
    if min(heights) < _BELOW_DEG:
        return -np.inf
    low = [number for number, height in enumerate(heights) if height <= min(heights) + _LOW_DEG]
    return ground_level(sights, low)
