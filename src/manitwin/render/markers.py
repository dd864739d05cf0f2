"""Numbered markers on images: a dot at each point, with a label beside it where there is room."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import cv2
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from manitwin.render.cameras import Camera, project

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont
DOT = (226, 26, 92)
INK = (18, 22, 30)
PAPER = (255, 255, 255)
X_AXIS, Z_AXIS = (214, 48, 49), (30, 80, 220)
DIRECTIONS = 16
RINGS = (1.0, 1.35, 1.8, 2.4, 3.2, 4.2, 5.5, 7.0)  # distances of a label from its dot, in heights of its box
DOT_SHARE = 0.36  # fraction of a box's height: radius of a dot including its edge and one pixel
_SUBPIXEL = 4  # bits: OpenCV draws at sixteenths of a pixel


def draw_markers(
    picture: np.ndarray,
    pixels: np.ndarray,
    labels: Sequence[str],
    *,
    occupied: np.ndarray | None = None,
    colors: Sequence[tuple[int, int, int]] | None = None,
    dot: tuple[int, int, int] = DOT,
    font_px: int = 13,
) -> np.ndarray:
    """Draw a dot at each of ``pixels (N, 2)``, with its label in a box beside it.

    Returns the image ``(H, W, 3) uint8``. Boxes avoid dots and each other as far as possible, and are connected to their dot by
    a line; they preferably leave ``occupied (H, W) bool``, the object, uncovered. ``colors`` are those of dots and boxes (None:
    dots of colour ``dot``, dark boxes). Equal input gives equal pixels.
    """
    dots, fills = colors or [dot] * len(labels), colors or [INK] * len(labels)
    sizes = np.array([_box_size(label, font_px) for label in labels], dtype=float).reshape(-1, 2)
    centers = place_boxes(pixels, sizes, picture.shape[:2], occupied)
    canvas = picture.copy()
    for color, width in ((PAPER, 3), (INK, 1)):
        for pixel, center in zip(pixels, centers, strict=True):
            cv2.line(canvas, _fixed(pixel), _fixed(center), color, width, cv2.LINE_AA, _SUBPIXEL)
    radius = font_px * 0.32
    for pixel, fill in zip(pixels, dots, strict=True):
        for color, size in ((PAPER, radius + 1.5), (fill, radius)):
            cv2.circle(canvas, _fixed(pixel), round(size * 2**_SUBPIXEL), color, -1, cv2.LINE_AA, _SUBPIXEL)
    image = Image.fromarray(canvas)
    draw = ImageDraw.Draw(image)
    for label, center, extent, fill in zip(labels, centers, sizes, fills, strict=True):
        low = np.rint(center - extent / 2)
        draw.rounded_rectangle((*low, *(low + extent - 1)), radius=font_px / 4, fill=fill, outline=PAPER)
        draw.text(tuple(low + extent / 2), label, fill=PAPER, font=font_of(font_px), anchor="mm")
    return np.asarray(image)


def draw_frames(
    picture: np.ndarray, frames_to_object: Sequence[np.ndarray], camera: Camera, length_m: float
) -> np.ndarray:
    """Draw the Z (blue, ``length_m`` long) and X axes (red, half as long) of frames ``(4, 4)`` in front of everything."""
    canvas = picture.copy()
    for frame in frames_to_object:
        for axis, share, color in ((0, 0.5, X_AXIS), (2, 1.0, Z_AXIS)):
            ends = frame[:3, 3] + np.outer([0.0, share * length_m], frame[:3, axis])
            start, tip = project(ends, camera)[0]
            for shade, width in ((PAPER, 5), (color, 3)):
                cv2.arrowedLine(canvas, _whole(start), _whole(tip), shade, width, cv2.LINE_AA, tipLength=0.25)
    return canvas


def _whole(pixel: np.ndarray) -> tuple[int, int]:
    column, row = np.clip(np.rint(pixel), -10_000, 10_000)
    return int(column), int(row)


def font_px(width_px: int, height_px: int) -> int:
    """Return the font size of labels: 13 px for an image of 512 x 512, legible for people and models."""
    return max(9, round((width_px * height_px) ** 0.5 * 13 / 512))


def place_boxes(
    pixels: np.ndarray, sizes: np.ndarray, shape: tuple[int, int], occupied: np.ndarray | None = None
) -> np.ndarray:
    """Return centres ``(N, 2)`` for boxes of ``sizes (N, 2)`` near their points, with little overlap.

    Greedy, most crowded point first: the cheapest of 16 directions on rings around the point, by overlap with placed boxes,
    covered dots, lines crossing other dots and boxes, distance, and covered object.
    """
    count = len(pixels)
    if not count:
        return np.zeros((0, 2))
    gap = sizes[:, 1].max()
    angles = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    ring, angle = (a.reshape(-1) for a in np.meshgrid(np.array(RINGS), angles, indexing="ij"))
    cover = _covered_share(occupied, sizes.mean(0)) if occupied is not None else np.zeros(shape)
    apart = np.linalg.norm(pixels[:, None] - pixels[None], axis=2)
    crowd = (1 / (apart + gap)).sum(1)
    outward = pixels - pixels.mean(0)
    outward = outward / np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    centers, placed = np.zeros((count, 2)), np.zeros(count, dtype=bool)
    for index in sorted(range(count), key=lambda i: (-crowd[i], i)):
        half = sizes[index] / 2
        direction = np.stack([np.cos(angle), np.sin(angle)], 1)
        options = pixels[index] + direction * (ring[:, None] * gap + [half[0] - half[1], 0])
        options = np.clip(options, half + 1, np.array(shape[::-1]) - half - 1)
        cost = 0.35 * ring - 0.08 * direction @ outward[index]
        cost += 0.5 * cover[options[:, 1].astype(int), options[:, 0].astype(int)]
        cost += 8 * _overlap(options, half, centers[placed], sizes[placed] / 2).sum(1)
        cost += 4 * _overlap(options, half, pixels, np.full((count, 2), gap * 0.3)).sum(1)
        cost += 1.0 * _crossings(pixels[index], options, pixels[placed], centers[placed])
        others = np.delete(pixels, index, axis=0)
        cost += 6 * (_from_lines(pixels[index], options, others) < gap * DOT_SHARE).sum(1)
        cost += 2 * (_from_lines(pixels[index], options, centers[placed]) < gap / 2).sum(1)
        centers[index], placed[index] = options[int(cost.argmin())], True
    return centers


def _overlap(options: np.ndarray, half: np.ndarray, others: np.ndarray, other_half: np.ndarray) -> np.ndarray:
    """Return the share ``(O, M)`` of a box at each option that overlaps each other box."""
    reach = half + other_half + 1.0
    wide, high = (  # axis by axis, as NumPy is slow over a last axis of two
        np.minimum(np.maximum(reach[:, k] - np.abs(options[:, k, None] - others[:, k]), 0), 2 * half[k]) for k in (0, 1)
    )
    return wide * high / (4 * half.prod())


def _crossings(start: np.ndarray, ends: np.ndarray, starts: np.ndarray, stops: np.ndarray) -> np.ndarray:
    """Count the lines from ``starts`` to ``stops`` crossed by the line from ``start`` to each of ``ends (O, 2)``."""

    def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])

    e, p, q = ends[:, None], starts[None], stops[None]
    return ((side(start, e, p) * side(start, e, q) < 0) & (side(p, q, start) * side(p, q, e) < 0)).sum(1)


def _from_lines(start: np.ndarray, ends: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the distances ``(O, M)`` of points from the segments from ``start`` to each of ``ends (O, 2)``."""
    x, y = (points - start).T
    along_x, along_y = ((ends - start).T)[:, :, None]
    share = (x * along_x + y * along_y) / np.maximum(along_x**2 + along_y**2, 1e-9)
    share = np.minimum(np.maximum(share, 0), 1)
    return np.hypot(x - share * along_x, y - share * along_y)


def _covered_share(occupied: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return the occupied share of a box of ``size`` around each pixel."""
    return cv2.blur(occupied.astype(np.float32), (max(1, int(size[0])), max(1, int(size[1]))))


@cache
def font_of(size_px: int) -> Font:
    """Return the font used in all images."""
    return ImageFont.load_default(size_px)


def _box_size(label: str, font_px: int) -> tuple[int, int]:
    left, _, right, _ = font_of(font_px).getbbox(label)
    return int(right - left) + round(font_px * 0.55), round(font_px * 1.25)


def _fixed(point: np.ndarray) -> tuple[int, int]:
    """Return a point in OpenCV's fixed-point pixel coordinates, in which pixel centres are integers."""
    x, y = np.rint((point - 0.5) * 2**_SUBPIXEL).astype(int)
    return int(x), int(y)
