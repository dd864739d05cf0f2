"""One picture of the first scenes of a run, each with its id: to see at a glance what was made."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from manitwin.errors import UsageError
from manitwin.scenes.layouts.layout_stages import PICTURES
from manitwin.scenes.layouts.preview import scene_pictures
from manitwin.scenes.layouts.run import CONTACT_SHEET, accepted_scenes
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_file import parse_scene
from manitwin.scenes.scene_folders import scene_name
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import TwinSource

SCENES_SHOWN = 48
CAMERA = "oblique"
TILE_PX, MOST_COLUMNS, CAPTION_PX, GAP_PX = 256, 8, 18, 4
WEBP_QUALITY = 85


def write_contact_sheet(dataset: str | Path, out: str | Path, *, most: int = SCENES_SHOWN) -> int:
    """Write ``contact_sheet.webp`` of the first scenes of a run at ``out``; returns how many it shows.

    A scene whose pictures were made already is not drawn again. Raises UsageError for a run without an accepted scene,
    RendererMissing.
    """
    root, source = DatasetRoot(out), TwinSource(dataset)
    shown = accepted_scenes(out)[:most]
    if not shown:
        raise UsageError(f"{out}: no scene was accepted, so that there is none to show")
    sheet = contact_sheet([(scene_id, _picture(root, source, scene_id)) for scene_id in shown])
    stream = io.BytesIO()
    sheet.save(stream, "WEBP", quality=WEBP_QUALITY, method=4)
    root.write_bytes(CONTACT_SHEET, stream.getvalue())
    return len(shown)


def contact_sheet(pictures: Sequence[tuple[str, np.ndarray]]) -> Image.Image:
    """Return pictures ``(TILE_PX, TILE_PX, 3) uint8`` RGB row by row, each with its caption below it."""
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


def _picture(root: DatasetRoot, source: TwinSource, scene_id: str) -> np.ndarray:
    """Return a scene from its oblique camera, ``(TILE_PX, TILE_PX, 3) uint8``."""
    folder = scene_name(scene_id)
    drawn = f"{folder}/{PICTURES}{CAMERA}_rgb.webp"
    if root.exists(drawn):
        with Image.open(io.BytesIO(root.read_bytes(drawn))) as image:
            return np.asarray(image.convert("RGB").resize((TILE_PX, TILE_PX), Image.Resampling.LANCZOS))
    scene = parse_scene(root.read_bytes(f"{folder}/{SCENE}"), scene_id)
    camera = tuple(each for each in scene.cameras if each.name == CAMERA)
    frames, _ = scene_pictures(
        scene.model_copy(update={"cameras": camera}), source.folder, width_px=TILE_PX, height_px=TILE_PX
    )
    return frames[CAMERA].rgb
