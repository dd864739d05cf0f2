"""Make templates.webp beside this file: one thing of every template, with its category below it.

python docs/make_templates_picture.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import ObjectDescription
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template_object import visual_parts
from manitwin.render.cameras import hero_camera
from manitwin.render.renderer import shared_renderer

PICTURE = Path(__file__).resolve().parent / "templates.webp"
SEED = 0
COLUMNS, TILE_PX, LABEL_PX = 18, 100, 14
INK, FONT_PX, FOV_Y_DEG = (70, 70, 74), 11, 25.0


def templates_picture() -> Image.Image:
    """Draw one thing of each template, as its seed makes it, sorted by name."""
    templates = load_templates()
    rows = -(-len(templates) // COLUMNS)
    picture = Image.new("RGB", (COLUMNS * TILE_PX, rows * (TILE_PX + LABEL_PX)), "white")
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(FONT_PX)
    for number, (category, template) in enumerate(templates.items()):
        parts = visual_parts(make_object(template, ObjectDescription(category), np.random.default_rng(SEED)))
        points = np.concatenate([part.vertices for part in parts])
        camera = hero_camera(points, fov_y_deg=FOV_Y_DEG, width_px=TILE_PX, height_px=TILE_PX)
        drawn = shared_renderer().render(parts, [camera], background=(255, 255, 255))[0].rgb
        left, top = number % COLUMNS * TILE_PX, number // COLUMNS * (TILE_PX + LABEL_PX)
        picture.paste(Image.fromarray(drawn), (left, top))
        draw.text((left + TILE_PX / 2, top + TILE_PX + LABEL_PX - 4), category, fill=INK, font=font, anchor="ms")
    return picture


if __name__ == "__main__":
    templates_picture().save(PICTURE, quality=82, method=6)
