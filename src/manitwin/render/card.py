"""The card of a twin: input | render | mesh and hulls | points and verified grasps, with the facts above.

Source: the four columns of the paper's "Dataset Examples".
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import trimesh
from PIL import Image, ImageDraw

from manitwin.geometry.hulls.reduction import convex_corners
from manitwin.render.cameras import hero_camera, is_tall
from manitwin.render.card_panels import (
    DRAWN_GRASPS,
    FUNCTIONAL,
    GRASP,
    GRASP_COLORS,
    CardGrasp,
    CardPoint,
    clay_panel,
    grasp_panel,
    input_panel,
    mesh_panel,
    render_panel,
)
from manitwin.render.center_of_mass import CenterOfMass
from manitwin.render.markers import font_of
from manitwin.render.raycast import merge_parts
from manitwin.render.renderer import BACKDROP

WIDTH, HEIGHT = 1600, 540
MARGIN, GAP = 24, 16
PANEL = (WIDTH - 2 * MARGIN - 3 * GAP) // 4
TOP = 96
FOV_Y_DEG = 24.0
INK, GREY, PALE = (24, 28, 36), (112, 120, 132), (214, 218, 224)
RED = (200, 24, 32)


@dataclass(frozen=True)
class CardText:
    """The text of a card: title, sentence, facts as (name, value) from left to right, and footer.

    ``stamp`` is a word printed across all images except the input.
    """

    title: str
    sentence: str
    facts: Sequence[tuple[str, str]]
    footer: str
    stamp: str | None = None


def make_card(
    *,
    parts: Sequence[trimesh.Trimesh],
    solid: trimesh.Trimesh,
    hulls: Sequence[np.ndarray],
    points: Sequence[CardPoint],
    grasps: Sequence[CardGrasp],
    text: CardText,
    mass: CenterOfMass | None = None,
    photo: np.ndarray | None = None,
    prompt: str | None = None,
) -> bytes:
    """Draw a twin's card and return it as PNG.

    ``parts`` are the textured meshes, ``solid`` the repaired mesh, ``hulls`` the vertices ``(V, 3)`` of each collision hull,
    all in the object frame in metres; ``mass`` is drawn over the hulls. A standing object made from a photo or text is seen
    from its front. The first column shows ``photo (H, W, 3 or 4) uint8``, whose side the next two columns show as well, or
    ``prompt``; for a mesh input it shows the untextured shape. Raises RendererMissing if no renderer is available.
    """
    mesh = merge_parts(list(parts))
    outline = convex_corners(np.asarray(mesh.vertices))[0]  # sufficient for choosing the camera
    from_front = photo is not None or (prompt is not None and is_tall(outline))
    hero = hero_camera(outline, fov_y_deg=FOV_Y_DEG, width_px=PANEL, height_px=PANEL, from_front=from_front)
    if photo is not None:
        first, caption = input_panel(photo, PANEL), "input photo, cut out"
    elif prompt is not None:
        first, caption = _prompt_panel(prompt), "input text"
    else:
        first, caption = clay_panel(mesh, hero), "input mesh, from behind"
    drawn = min(len(grasps), DRAWN_GRASPS)
    columns = (
        (first, caption),
        (render_panel(parts, mesh, hero), "twin as rendered"),
        (mesh_panel(solid, hulls, hero, mass), mesh_caption(len(solid.faces), len(hulls))),
        (grasp_panel(parts, mesh, points, grasps, hero), f"points, and {drawn} of {len(grasps)} verified grasps"),
    )
    card = Image.new("RGB", (WIDTH, HEIGHT), "white")
    draw = ImageDraw.Draw(card)
    _header(draw, text)
    for index, (picture, caption) in enumerate(columns):
        left = MARGIN + index * (PANEL + GAP)
        card.paste(Image.fromarray(picture), (left, TOP), _rounded_mask())
        draw.text((left + 2, TOP + PANEL + 18), caption, fill=INK, font=font_of(15), anchor="lm")
        if text.stamp is not None and index > 0:  # the input is not stamped
            _stamp(card, text.stamp, left, TOP)
    _legend(draw)
    room = 1400 if mass is None else _mass_legend(draw, MARGIN + 3 * PANEL + 2 * GAP, HEIGHT - 16) - MARGIN - GAP
    draw.text((MARGIN + 2, HEIGHT - 16), _shortened(text.footer, room, 12), fill=GREY, font=font_of(12), anchor="lm")
    stream = io.BytesIO()
    card.save(stream, "PNG", compress_level=5)
    return stream.getvalue()


def _stamp(card: Image.Image, word: str, left: int, top: int) -> None:
    """Print a word in a tilted, semi-transparent frame across a panel."""
    font = font_of(46)
    width, height = round(font.getlength(word)) + 36, 74
    stamp = Image.new("RGBA", (width, height), (255, 255, 255, 150))
    draw = ImageDraw.Draw(stamp)
    draw.rectangle((2, 2, width - 3, height - 3), outline=(*RED, 255), width=4)
    draw.text((width / 2, height / 2), word, fill=(*RED, 255), font=font, anchor="mm")
    turned = stamp.rotate(18, expand=True, resample=Image.Resampling.BICUBIC)
    card.paste(turned, (left + (PANEL - turned.width) // 2, top + (PANEL - turned.height) // 2), turned)


def _header(draw: ImageDraw.ImageDraw, text: CardText) -> None:
    """Write the facts right-aligned, and the title in the remaining space."""
    right = WIDTH - MARGIN
    for name, value in reversed(text.facts):
        width = max(font_of(21).getlength(value), font_of(13).getlength(name))
        draw.text((right - width, 30), name, fill=GREY, font=font_of(13), anchor="lm")
        draw.text((right - width, 57), value, fill=INK, font=font_of(21), anchor="lm")
        right -= round(width) + 20
        draw.line((right, 24, right, 68), fill=PALE, width=1)
        right -= 20
    room = right - MARGIN
    draw.text((MARGIN, 38), _shortened(text.title, room, 34), fill=INK, font=font_of(34), anchor="lm")
    draw.text((MARGIN + 1, 72), _shortened(text.sentence, room, 15), fill=GREY, font=font_of(15), anchor="lm")


def _legend(draw: ImageDraw.ImageDraw) -> None:
    """Draw the colour legend of the last column."""
    x, y = WIDTH - MARGIN, HEIGHT - 16
    for label, color in (("verified grasp", GRASP_COLORS[0]), ("grasp point", GRASP), ("functional point", FUNCTIONAL)):
        x -= round(font_of(12).getlength(label))
        draw.text((x, y), label, fill=GREY, font=font_of(12), anchor="lm")
        x -= 14
        draw.ellipse((x, y - 4, x + 8, y + 4), fill=color)
        x -= 18


def _mass_legend(draw: ImageDraw.ImageDraw, right: int, y: int) -> int:
    """Draw the legend of the centre of mass, right-aligned at ``right``; return its left edge."""
    words = "centre of mass; ring: how far it may be off"
    left = right - round(font_of(12).getlength(words))
    draw.text((left, y), words, fill=GREY, font=font_of(12), anchor="lm")
    draw.ellipse((left - 18, y - 6, left - 6, y + 6), fill="white", outline=INK)
    for start in (90, 270):
        draw.pieslice((left - 18, y - 6, left - 6, y + 6), start, start + 90, fill=INK)
    return left - 18


def _prompt_panel(prompt: str) -> np.ndarray:
    """Write the prompt centred in a panel."""
    panel = Image.new("RGB", (PANEL, PANEL), BACKDROP)
    lines = textwrap.wrap(f"“{prompt}”", 30)[:10]
    ImageDraw.Draw(panel).multiline_text(
        (PANEL / 2, PANEL / 2), "\n".join(lines), fill=INK, font=font_of(20), anchor="mm", align="center", spacing=8
    )
    return np.asarray(panel)


def mesh_caption(triangles: int, hulls: int) -> str:
    """Return the caption of the mesh panel."""
    return f"{triangles:,} triangles, {hulls} convex collision {'hull' if hulls == 1 else 'hulls'}"


def _shortened(text: str, room_px: float, size_px: int) -> str:
    """Truncate a line to a width."""
    font = font_of(size_px)
    if font.getlength(text) <= room_px:
        return text
    while text and font.getlength(text + "...") > room_px:
        text = text[:-1]
    return text.rstrip() + "..."


@cache
def _rounded_mask() -> Image.Image:
    mask = Image.new("L", (4 * PANEL, 4 * PANEL), 0)
    ImageDraw.Draw(mask).rounded_rectangle((0, 0, 4 * PANEL - 1, 4 * PANEL - 1), radius=40, fill=255)
    return mask.reduce(4)
