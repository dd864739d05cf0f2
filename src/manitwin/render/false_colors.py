"""False-colour images of depth maps and id maps with legends, for display only.

Equal arrays give equal bytes.
"""

from __future__ import annotations

import colorsys
from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from PIL import Image, ImageDraw

from manitwin.render.markers import Font, font_of

NOTHING_RGB = (40, 40, 40)
"""Colour of pixels without depth and of the id 0 (floor and backdrop)."""

DEPTH_TICKS = 6
_GOLDEN_RATIO = (5**0.5 - 1) / 2
_TONES = ((0.95, 1.0), (0.4, 1.0), (1.0, 0.5), (0.5, 0.75), (0.7, 0.95))
"""Saturation and value in turn; with five, hues of one tone become similar only after 55 ids (a Fibonacci number)."""

_INK_RGB, _GROUND_RGB = (235, 235, 235), (20, 20, 20)


def depth_range_m(depth_m: np.ndarray, ids: np.ndarray) -> tuple[float, float] | None:
    """Return the least and largest depth in ``(H, W)`` of pixels with an id; None if there are none.

    Floor and backdrop are excluded, as they are metres behind the objects.
    """
    shown = depth_m[(ids > 0) & (depth_m > 0)]
    return (float(shown.min()), float(shown.max())) if len(shown) else None


def depth_in_colors(depth_m: np.ndarray, range_m: tuple[float, float]) -> np.ndarray:
    """Return a depth map ``(H, W)`` as ``(H, W, 3) uint8`` RGB: red is near, blue is far or beyond, dark grey is no depth."""
    near, far = range_m
    share = np.clip((depth_m - near) / max(far - near, 1e-6), 0, 1)
    colors = _turbo(np.rint(255 * (1 - share)).astype(np.uint8))
    colors[depth_m <= 0] = NOTHING_RGB
    return colors


def id_color(number: int) -> tuple[int, int, int]:
    """Return the colour (RGB) of an id: hues spaced by the golden ratio, in five tones in turn; 0 is dark grey."""
    if number == 0:
        return NOTHING_RGB
    saturation, value = _TONES[(number - 1) % len(_TONES)]
    red, green, blue = colorsys.hsv_to_rgb((number - 1) * _GOLDEN_RATIO % 1, saturation, value)
    return round(255 * red), round(255 * green), round(255 * blue)


def ids_in_colors(ids: np.ndarray) -> np.ndarray:
    """Return a map of ids ``(H, W)`` as ``(H, W, 3) uint8`` RGB, each in its ``id_color``."""
    palette = np.array([id_color(number) for number in range(int(ids.max()) + 1)], np.uint8)
    colors: np.ndarray = palette[ids]
    return colors


def depth_picture(depth_m: np.ndarray, ids: np.ndarray) -> Image.Image:
    """Return a depth map in colours, with a scale in metres on its right unless no pixel has an id."""
    range_m = depth_range_m(depth_m, ids)
    if range_m is None:
        return Image.fromarray(np.full((*depth_m.shape, 3), NOTHING_RGB, np.uint8))
    near, far = range_m
    height = len(depth_m)
    marks = [f"{value:.3f} m" for value in np.linspace(near, far, DEPTH_TICKS)]
    marks[-1] += " +"  # also the colour of anything farther
    font = font_of(max(8, height // 28))
    margin, bar = max(4, height // 32), max(6, height // 20)
    strip = _strip(height, 3 * margin + bar + _widest(marks, font))
    scale = _turbo(np.linspace(255, 0, height - 2 * margin).round().astype(np.uint8)[:, None])
    strip.paste(Image.fromarray(scale).resize((bar, height - 2 * margin)), (margin, margin))
    draw = ImageDraw.Draw(strip)
    for mark, y in zip(marks, np.linspace(margin, height - margin, DEPTH_TICKS), strict=True):
        anchor = "la" if mark is marks[0] else "ld" if mark is marks[-1] else "lm"
        draw.text((2 * margin + bar, y), mark, _INK_RGB, font, anchor=anchor)
    return _side_by_side(depth_in_colors(depth_m, range_m), strip)


def ids_picture(ids: np.ndarray, names: Mapping[str, int]) -> Image.Image:
    """Return a map of ids in colours, with a legend of the visible ids' names on its right."""
    height = len(ids)
    seen = set(np.unique(ids).tolist())
    shown = [(name, number) for name, number in names.items() if number in seen]
    if not shown:
        return Image.fromarray(ids_in_colors(ids))
    font_px = max(8, min(height // 28, height // (len(shown) + 1)))
    font, row = font_of(font_px), round(1.4 * font_px)
    rows = max(1, height // row)
    column = 2 * row + _widest([name for name, _ in shown], font)
    strip = _strip(height, column * -(-len(shown) // rows))
    draw = ImageDraw.Draw(strip)
    for place, (name, number) in enumerate(shown):
        x, y = column * (place // rows), row * (place % rows)
        draw.rectangle((x + row // 3, y + row // 6, x + row, y + row - row // 6), id_color(number))
        draw.text((x + 4 * row // 3, y + row / 2), name, _INK_RGB, font, anchor="lm")
    return _side_by_side(ids_in_colors(ids), strip)


def _turbo(values: np.ndarray) -> np.ndarray:
    """Return RGB of values between 0 and 255 (Mikhailov, "Turbo, An Improved Rainbow Colormap", 2019)."""
    colors: np.ndarray = cv2.applyColorMap(values, cv2.COLORMAP_TURBO)[..., ::-1].copy()
    return colors


def _strip(height_px: int, width_px: int) -> Image.Image:
    return Image.new("RGB", (width_px, height_px), _GROUND_RGB)


def _side_by_side(picture: np.ndarray, strip: Image.Image) -> Image.Image:
    height, width, _ = picture.shape
    page = Image.new("RGB", (width + strip.width, height))
    page.paste(Image.fromarray(picture), (0, 0))
    page.paste(strip, (width, 0))
    return page


def _widest(words: Sequence[str], font: Font) -> int:
    return round(max(font.getlength(word) for word in words)) + 1
