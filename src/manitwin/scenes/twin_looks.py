"""What pictures of scenes need of a twin, read once and kept from scene to scene."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from manitwin.render.drawable import Drawable, drawable
from manitwin.scenes.perception.object_views import SeenShape
from manitwin.twin.mesh_files import read_visual
from manitwin.twin.store import RECORD

TWINS_KEPT, SIMPLIFIED_KEPT = 32, 64
"""In one process: a textured twin takes some 10 MB, a simplified one less, and a CPU-second to make."""


def twin_looks(folder: Path, picture_px: int) -> Drawable:
    """Return a twin's visual surface, as it is, for pictures of ``picture_px``; raises TwinError.

    Its textures get at most twice the pixels each way that a whole picture has, which is what is drawn before it is reduced.
    """
    return _looks(folder, _version(folder), 2 * picture_px)


def simplified_twin_looks(folder: Path, tolerance_m: float) -> Drawable:
    """Return a twin's visual surface for small pictures, simplified by about a tolerance; raises TwinError."""
    return _simplified_looks(folder, _version(folder), tolerance_m)


def seen_shape(folder: Path) -> SeenShape:
    """Return a twin as rays see it; raises TwinError."""
    return _shape(folder, _version(folder))


@lru_cache(maxsize=TWINS_KEPT)
def _looks(folder: Path, version: tuple[int, int], most_texture_px: int) -> Drawable:
    return drawable(read_visual(folder / "visual.glb"), most_texture_px=most_texture_px)


@lru_cache(maxsize=SIMPLIFIED_KEPT)
def _simplified_looks(folder: Path, version: tuple[int, int], tolerance_m: float) -> Drawable:
    return drawable(read_visual(folder / "visual.glb"), tolerance_m=tolerance_m)


@lru_cache(maxsize=TWINS_KEPT)
def _shape(folder: Path, version: tuple[int, int]) -> SeenShape:
    return SeenShape.of_twin(folder)


def _version(folder: Path) -> tuple[int, int]:
    """Tell a twin from one that was built again in its place."""
    try:
        found = (folder / RECORD).stat()
    except OSError:
        return 0, 0  # reading the twin says what is wrong
    return found.st_mtime_ns, found.st_size
