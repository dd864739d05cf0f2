"""The colour of an object in a picture: the leading colour of its whole surface may lie on the far side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manitwin.geometry.poses import inverse
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.annotators.surface_color import base_colors_at, lab_from_srgb, name_colors
from manitwin.render.cameras import Camera
from manitwin.render.raycast import cast_pixels
from manitwin.twin.loaded_twin import Twin

SURE_PERCENT, SURE_GREY_PERCENT, LEAD_PERCENT = 50, 80, 10
"""A colour is named if it covers this percentage, with this lead over the next; greys are less salient and need more."""
GREYS = ("white", "grey", "black")
_MOST_PX = 256


def main_word(color: str) -> str:
    """Return the last word of a colour, ``green`` for ``dark green``."""
    return color.split()[-1]


def leading(found: Sequence[tuple[str, float]]) -> str | None:
    """Return the first of the colours ``(name, percent)`` if it leads; else None."""
    if not found:
        return None
    (name, percent), next_percent = found[0], max((percent for _, percent in found[1:]), default=0)
    least_percent = SURE_GREY_PERCENT if main_word(name) in GREYS else SURE_PERCENT
    return None if percent < least_percent or percent - next_percent < LEAD_PERCENT else name


def is_color_visible(
    color: str, twin: Twin, caster: RayCaster, pose: np.ndarray, camera: Camera, mask: np.ndarray
) -> bool:
    """Return whether a colour word also leads on the visible surface of a twin.

    ``mask (H, W) bool`` are its visible pixels and ``pose (4, 4)`` is its pose. Base colours are sampled where rays through
    some of the pixels hit its visual surface.
    """
    rows, columns = np.nonzero(mask)
    chosen = np.unique(np.linspace(0, len(rows) - 1, _MOST_PX).astype(int))
    of_thing = replace(camera, camera_to_object=inverse(pose) @ camera.camera_to_object)
    points, _, faces = cast_pixels(caster, of_thing, np.column_stack([rows, columns])[chosen])
    met = faces >= 0
    if not met.any():
        return False
    colors = _colors(twin, faces[met], points[met])
    shares = [(each.name, 100 * each.share) for each in name_colors(lab_from_srgb(colors), metallic=False)]
    name = leading(shares)
    return name is not None and main_word(name) == main_word(color)


def _colors(twin: Twin, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the base colours ``(N, 3)`` at points on faces, which are indices into the concatenated visual parts."""
    found = np.zeros((len(faces), 3))
    begin = 0
    for part in twin.visual:
        at = (faces >= begin) & (faces < begin + len(part.faces))
        if at.any():
            found[at] = base_colors_at(part, faces[at] - begin, points[at])
        begin += len(part.faces)
    return found
