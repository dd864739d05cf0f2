"""Visual surfaces of twins for pictures of scenes, cached over scenes."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from manitwin.render.drawable import Drawable, prepare_drawable
from manitwin.scenes.perception.object_views import RaycastShape
from manitwin.twin.mesh_files import read_visual
from manitwin.twin.store import RECORD

TWINS_KEPT, SIMPLIFIED_KEPT = 32, 64
"""Cache sizes in a process: a textured twin takes some 10 MB; a simplified one takes less, and a CPU-second to make."""


def twin_drawable(folder: Path, picture_px: int) -> Drawable:
    """Return a twin's visual surface without simplification, for pictures of ``picture_px``; raises TwinError.

    Its textures get at most twice the side of a picture in pixels, which is the resolution before downsampling.
    """
    return _cached_drawable(folder, _version(folder), 2 * picture_px)


def simplified_twin_drawable(folder: Path, tolerance_m: float) -> Drawable:
    """Return a twin's visual surface for small pictures, simplified with about this tolerance; raises TwinError."""
    return _simplified_looks(folder, _version(folder), tolerance_m)


def raycast_shape(folder: Path) -> RaycastShape:
    """Return a twin's surface for ray casting; raises TwinError."""
    return _shape(folder, _version(folder))


@lru_cache(maxsize=TWINS_KEPT)
def _cached_drawable(folder: Path, version: tuple[int, int], most_texture_px: int) -> Drawable:
    return prepare_drawable(read_visual(folder / "visual.glb"), most_texture_px=most_texture_px)


@lru_cache(maxsize=SIMPLIFIED_KEPT)
def _simplified_looks(folder: Path, version: tuple[int, int], tolerance_m: float) -> Drawable:
    return prepare_drawable(read_visual(folder / "visual.glb"), tolerance_m=tolerance_m)


@lru_cache(maxsize=TWINS_KEPT)
def _shape(folder: Path, version: tuple[int, int]) -> RaycastShape:
    return RaycastShape.of_twin(folder)


def _version(folder: Path) -> tuple[int, int]:
    """Return a cache key that changes when a twin is rebuilt in place."""
    try:
        found = (folder / RECORD).stat()
    except OSError:
        return 0, 0  # reading the twin reports the error
    return found.st_mtime_ns, found.st_size
