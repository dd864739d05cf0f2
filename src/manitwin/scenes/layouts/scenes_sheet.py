"""Contact sheet of the first scenes of a run of layouts."""

from __future__ import annotations

import io
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from manitwin.errors import InputError, UsageError
from manitwin.formats.image_file import read_image
from manitwin.render.contact_sheet import TILE_PX, contact_sheet
from manitwin.scenes.layouts.layouts_recipe import PICTURES
from manitwin.scenes.layouts.layouts_run import CONTACT_SHEET, accepted_scenes
from manitwin.scenes.layouts.previews import scene_pictures
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_files import parse_scene, scene_name
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import TwinSource

SCENES_SHOWN = 48
CAMERA = "oblique"
SHEET_QUALITY = 85


def write_contact_sheet(dataset: str | Path, out: str | Path, *, most: int = SCENES_SHOWN) -> int:
    """Write ``contact_sheet.webp`` with the first scenes of a run at ``out``; return the number of scenes shown.

    Existing pictures of scenes are reused. Raises UsageError for a run without an accepted scene, RendererMissing.
    """
    root, source = DatasetRoot(out), TwinSource(dataset)
    shown = accepted_scenes(out)[:most]
    if not shown:
        raise UsageError(f"{out}: there is no accepted scene to show; `manitwin status {out}` shows why")
    sheet = contact_sheet([(scene_id, _picture(root, source, scene_id)) for scene_id in shown])
    stream = io.BytesIO()
    sheet.save(stream, "WEBP", quality=SHEET_QUALITY, method=4)
    root.write_bytes(CONTACT_SHEET, stream.getvalue())
    return len(shown)


def _read_picture(root: DatasetRoot, name: str) -> np.ndarray:
    """Return a picture of a scene, ``(H, W, 3) uint8``; raises UsageError if it is unreadable."""
    with TemporaryDirectory() as scratch:
        copy = Path(scratch) / PurePosixPath(name).name
        copy.write_bytes(root.read_bytes(name, UsageError))
        try:
            return read_image(copy).pixels[..., :3]
        except InputError as error:
            again = "remove the folder of its scene and rerun manitwin layout to make it again"
            raise UsageError(f"{root.full(name)}: not a readable picture; {again}") from error


def _picture(root: DatasetRoot, source: TwinSource, scene_id: str) -> np.ndarray:
    """Return a scene from its oblique camera, ``(TILE_PX, TILE_PX, 3) uint8``."""
    folder = scene_name(scene_id)
    drawn = f"{folder}/{PICTURES}{CAMERA}_rgb.webp"
    if root.exists(drawn):
        rgb = Image.fromarray(_read_picture(root, drawn))
        return np.asarray(rgb.resize((TILE_PX, TILE_PX), Image.Resampling.LANCZOS))
    scene = parse_scene(root.read_bytes(f"{folder}/{SCENE}"), scene_id)
    camera = tuple(each for each in scene.cameras if each.name == CAMERA)
    frames, _ = scene_pictures(
        scene.model_copy(update={"cameras": camera}), source.folder, width_px=TILE_PX, height_px=TILE_PX
    )
    return frames[CAMERA].rgb
