"""The colour that a picture shows of an object: what leads of the surface as a whole may lie on its far side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manitwin.geometry.poses import inverse
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.annotators.surface_color import base_colors_at, lab_from_srgb, named_colors
from manitwin.render.cameras import Camera
from manitwin.render.raycast import cast_pixels
from manitwin.twin.loaded_twin import Twin

SURE_PERCENT, SURE_GREY_PERCENT, LEAD_PERCENT = 50, 80, 10
"""A colour is named where it covers so much, and so much more than the next; greys catch the eye less."""
GREYS = ("white", "grey", "black")
_MOST_PX = 256


def main_word(color: str) -> str:
    """Return ``green`` of ``dark green``."""
    return color.split()[-1]


def leading(found: Sequence[tuple[str, float]]) -> str | None:
    """Return the first of some colours ``(name, percent)`` where it leads; None where it does not."""
    if not found:
        return None
    (name, percent), next_percent = found[0], max((percent for _, percent in found[1:]), default=0)
    least_percent = SURE_GREY_PERCENT if main_word(name) in GREYS else SURE_PERCENT
    return None if percent < least_percent or percent - next_percent < LEAD_PERCENT else name


def shows_color(color: str, twin: Twin, caster: RayCaster, pose: np.ndarray, camera: Camera, mask: np.ndarray) -> bool:
    """Whether a colour word also leads on what a picture shows of a twin.

    ``mask (H, W) bool`` are its visible pixels, ``pose (4, 4)`` is where it stands; base colours are read where rays through
    some of the pixels meet its visual surface.
    """
    rows, columns = np.nonzero(mask)
    chosen = np.unique(np.linspace(0, len(rows) - 1, _MOST_PX).astype(int))
    of_thing = replace(camera, camera_to_object=inverse(pose) @ camera.camera_to_object)
    points, _, faces = cast_pixels(caster, of_thing, np.column_stack([rows, columns])[chosen])
    met = faces >= 0
    if not met.any():
        return False
    colors = _colors(twin, faces[met], points[met])
    shares = [(each.name, 100 * each.share) for each in named_colors(lab_from_srgb(colors), metallic=False)]
    name = leading(shares)
    return name is not None and main_word(name) == main_word(color)


def _colors(twin: Twin, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the base colours ``(N, 3)`` at faces of the parts as one mesh."""
    found = np.zeros((len(faces), 3))
    begin = 0
    for part in twin.visual:
        at = (faces >= begin) & (faces < begin + len(part.faces))
        if at.any():
            found[at] = base_colors_at(part, faces[at] - begin, points[at])
        begin += len(part.faces)
    return found
