"""Contact sheets: images arranged in a grid."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

TILE_PX, MOST_COLUMNS, CAPTION_PX, GAP_PX = 256, 8, 18, 4


def contact_sheet(pictures: Sequence[tuple[str, np.ndarray]]) -> Image.Image:
    """Return captioned images ``(TILE_PX, TILE_PX, 3) uint8`` RGB arranged row by row."""
    columns = min(MOST_COLUMNS, math.ceil(math.sqrt(1.5 * len(pictures))))
    rows = -(-len(pictures) // columns)
    width, height = TILE_PX + GAP_PX, TILE_PX + CAPTION_PX + GAP_PX
    page = Image.new("RGB", (columns * width + GAP_PX, rows * height + GAP_PX), "white")
    draw, font = ImageDraw.Draw(page), ImageFont.load_default(CAPTION_PX - 4)
    for place, (caption, picture) in enumerate(pictures):
        x, y = GAP_PX + place % columns * width, GAP_PX + place // columns * height
        page.paste(Image.fromarray(picture), (x, y))
        draw.text((x + TILE_PX / 2, y + TILE_PX + CAPTION_PX / 2), caption, "black", font, anchor="mm")
    return page
