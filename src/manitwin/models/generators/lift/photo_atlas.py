"""Texture atlas of several photos' crops and their painted colours, about square because textures have a maximum side."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from manitwin.models.generators.lift.texture import Crop, paint_unseen

_PAINTED_SHARE = 0.5  # scale of the painted colours, which have no fine detail
AtlasBox = tuple[int, int, int, int]
"""Left, top, width, height in the atlas, in pixels."""


def photo_atlas(crops: Sequence[Crop]) -> tuple[np.ndarray, list[AtlasBox]]:
    """Return an atlas ``(H, W, 3) uint8`` of all crops and their painted colours, with the place of each, crops first."""
    painted = [paint_unseen(crop, None) for crop in crops]
    small = [
        cv2.resize(each, None, fx=_PAINTED_SHARE, fy=_PAINTED_SHARE, interpolation=cv2.INTER_AREA) for each in painted
    ]
    seen = min(
        (_layout_rows([c.colours.shape for c in crops], n) for n in range(1, len(crops) + 1)),
        key=lambda rows: max(rows[1]),
    )
    below = [_layout_rows([each.shape for each in small], n) for n in range(1, len(small) + 1)]
    under = max((rows for rows in below if rows[1][0] <= seen[1][0]), key=lambda rows: rows[1][0], default=below[0])
    (width, height), (other_width, other_height) = seen[1], under[1]
    atlas = np.zeros((height + other_height, max(width, other_width), 3), np.uint8)
    places = [*seen[0], *((left, top + height, *size) for left, top, *size in under[0])]
    for (left, top, wide, high), picture in zip(places, [*(crop.colours for crop in crops), *small], strict=True):
        atlas[top : top + high, left : left + wide] = picture
    return atlas, [(left, top, wide, high) for left, top, wide, high in places]


def _layout_rows(shapes: Sequence[tuple[int, ...]], columns: int) -> tuple[list[AtlasBox], tuple[int, int]]:
    """Return the places of pictures in rows of ``columns``, and the total width and height."""
    places: list[AtlasBox] = []
    top = width = 0
    for first in range(0, len(shapes), columns):
        row = shapes[first : first + columns]
        left = 0
        for shape in row:
            places.append((left, top, shape[1], shape[0]))
            left += shape[1]
        top, width = top + max(shape[0] for shape in row), max(width, left)
    return places, (width, top)
