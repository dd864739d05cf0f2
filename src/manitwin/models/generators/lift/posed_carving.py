"""Carve what photos with stated cameras show, from whatever distances and heights: the solid within all outlines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from manitwin.errors import Rejected
from manitwin.formats.camera_poses.posed_camera import PosedCamera
from manitwin.models.generators.lift.carved_solid import Carved, carved_of
from manitwin.models.generators.lift.pinhole import Sight, around
from manitwin.models.generators.lift.pinhole_carving import MASK_PX
from manitwin.models.generators.lift.pinhole_hull import covered_shares, ground_level, hull_field
from manitwin.models.generators.lift.posed_conventions import LEAST_COVERED, told
from manitwin.models.generators.lift.posed_sights import PosedPhoto, SeenPosed, posed_photos
from manitwin.models.generators.lift.texture import crop_object
from manitwin.models.generators.lift.turntable import SIDE_PX as ROUGH_SIDE_PX

SIDE_PX, CELLS = 640, 160
"""The longest side of the outlines' boxes, and the cells along the solid's longest side: poses that are measured are true to less
than what those that outlines tell are carved with, and of a tail that tapers 96 cells left a sixteenth out."""
LEAST_CROSSING = 0.3
"""The sine of the widest angle between two cameras' directions, below which they say the same."""
_MANY, _LEFT_OUT_OF = 6, 4  # of so many photos, at most one of four that does not go with the others
_BELOW_DEG, _LOW_DEG = -10.0, 15.0
"""Cameras that look up at the thing see its underside; those that tell the ground are so much above the lowest at most."""
_BASE_CUTS = (0.0, 0.01, 0.02)  # of the height: where lengths are measured, a base is cut off their precision at most


def carve_posed(
    photos: Sequence[tuple[str, np.ndarray]], cameras: Sequence[PosedCamera], turns_deg: Sequence[float]
) -> tuple[Carved, float]:
    """Carve what matted photos (name, ``(H, W, 4) uint8``) show; return also what 1 of its surface is in their unit.

    The cameras' world has z up; ``turns_deg`` are their turns about it, that of the first 0. Of six photos and more at most a
    quarter is left out where the others go together without them. Raises Rejected ``generator_failed``: where all are from one
    direction, and naming the photos whose poses do not go with their outlines, or the convention in which they do.
    """
    posed, unit = posed_photos(photos, cameras, turns_deg)
    rough = [photo.sight(ROUGH_SIDE_PX)[0] for photo in posed]
    kept, covered = _going_together(posed, rough, lambda *found: told(photos, cameras, *found))
    left_out = tuple(photo.name for number, photo in enumerate(posed) if number not in kept)
    posed = [posed[number] for number in kept]
    _require_crossing([rough[number] for number in kept])
    sights = [photo.sight(SIDE_PX)[0] for photo in posed]
    field, cell, origin = hull_field(sights, None, _ground(sights), CELLS)
    seen = [SeenPosed(each.name, each.turn_deg, crop_object(each.rgba, MASK_PX), each) for each in posed]
    carved = replace(carved_of(field, cell, origin, seen, covered, base_cuts=_BASE_CUTS), left_out=left_out)
    return carved, float(carved.to_carved[0, 0]) / unit


def _going_together(
    posed: Sequence[PosedPhoto], sights: Sequence[Sight], told: Callable[[Sequence[float], np.ndarray], str]
) -> tuple[list[int], list[float]]:
    """Return the photos that go together once the few are left out that do not, and how much of each outline is filled."""
    kept = list(range(len(posed)))
    first = covered, without = covered_shares(sights)
    most = len(posed) // _LEFT_OUT_OF if len(posed) >= _MANY else 0
    while min(covered) < LEAST_COVERED:
        if len(posed) - len(kept) >= most:
            raise Rejected("generator_failed", told(*first), "generate")
        # the one without which the others are filled most
        filled = [float(np.delete(without[:, k], k).mean()) for k in range(len(kept))]
        kept.pop(int(np.argmax(filled)))
        covered, without = covered_shares([sights[number] for number in kept])
    return kept, covered


def _require_crossing(sights: Sequence[Sight]) -> None:
    centre, _ = around(sights)
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


def _ground(sights: Sequence[Sight]) -> float:
    """Return how high the ground is; minus infinity where cameras look up at the thing, and see where it ends themselves.

    Cameras high above see what bulges out, and not the ground: the lowest ones tell it.
    """
    centre, _ = around(sights)
    heights = []
    for sight in sights:
        toward = sight.position - centre
        heights.append(float(np.rad2deg(np.arctan2(toward[2], np.hypot(toward[0], toward[1])))))
    if min(heights) < _BELOW_DEG:
        return -np.inf
    low = [number for number, height in enumerate(heights) if height <= min(heights) + _LOW_DEG]
    return ground_level(sights, low)
