"""Ground and marker colours that an object does not have."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.render.background_colors import (
    DARK_GROUND,
    MARKER_COLORS,
    background_of_pixels,
    foreground_mask,
    marker_color,
)
from manitwin.render.renderer import BACKDROP, Frame


def spotted(*colors: tuple[int, int, int]) -> np.ndarray:
    """A picture of an object with stripes of equal width, on plain ground."""
    picture = np.full((60, 80, 3), BACKDROP, np.uint8)
    width = 40 // len(colors)
    for number, color in enumerate(colors):
        picture[20:40, 20 + number * width : 20 + (number + 1) * width] = color
    return picture


@pytest.mark.parametrize(
    ("color", "ground"),
    [((250, 250, 250), DARK_GROUND), ((215, 214, 210), DARK_GROUND), ((250, 240, 180), DARK_GROUND),
     ((30, 30, 30), BACKDROP), ((90, 90, 95), BACKDROP), ((200, 30, 40), BACKDROP)],
)  # fmt: skip
def test_light_things_stand_on_darker_ground(color: tuple[int, int, int], ground: tuple[int, int, int]) -> None:
    assert background_of_pixels(np.full((500, 3), color, np.uint8)) == ground


@pytest.mark.parametrize("color", MARKER_COLORS)
def test_markers_have_a_colour_that_the_object_has_not(color: object) -> None:
    rgb = color.rgb  # type: ignore[attr-defined]
    chosen = marker_color([spotted(rgb, (128, 128, 128))])
    assert chosen != color and np.linalg.norm(np.subtract(chosen.rgb, rgb)) > 60


def test_markers_on_what_has_nearly_all_colours_are_of_the_rarest() -> None:
    colors = [color.rgb for color in MARKER_COLORS if color.name != "pink"]
    assert marker_color([spotted(*colors)]).name == "pink"


def test_moved_to_another_ground_only_the_ground_changes() -> None:
    coverage = np.zeros((4, 4), np.float32)
    coverage[1:3, 1:3] = 1
    rgb = np.where(coverage[..., None] > 0, (10, 200, 30), BACKDROP).astype(np.uint8)
    moved = Frame(rgb, coverage, coverage).composited_over(BACKDROP, DARK_GROUND)
    assert (moved[0, 0] == DARK_GROUND).all() and (moved[1, 1] == (10, 200, 30)).all()
    assert foreground_mask(moved).sum() == 4


def test_dark_red_print_is_red_too() -> None:
    assert marker_color([spotted((200, 170, 60), (120, 45, 45))]).name not in ("red", "yellow")
