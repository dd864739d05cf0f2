"""Appearance of a robot's links: visual shapes of its URDF, simplified for a picture size and cached on disk.

Reading COLLADA and simplifying takes some CPU seconds for an arm; the result has a megabyte or two.
"""

from __future__ import annotations

import hashlib
import json
import logging
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh

from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.readers.urdf_shapes import LinkShapes
from manitwin.errors import UsageError
from manitwin.formats.user_folders import cache_home
from manitwin.render.drawable import Drawable, prepare_drawable
from manitwin.render.drawable_file import MOST_BYTES, drawables_from_bytes, drawables_to_bytes
from manitwin.robots.urdf import UrdfTree
from manitwin.twin.store import write_bytes_atomically

RUN = logging.getLogger("manitwin.run")
LOOKS_VERSION = "2"
"""Change it whenever reading or simplification of links yields other surfaces, which invalidates the cache."""
WHOLE_FILES = (".dae", ".stl")
"""Mesh formats whose colours, except for textures, are in the file itself."""


@lru_cache(maxsize=4)
def link_visuals(urdf: str) -> dict[str, tuple[trimesh.Trimesh, ...]]:
    """Return the visual meshes of a URDF's links that have any, by name, in the link frames.

    COLLADA files keep their own colours; STL files and primitives have those of the URDF. Raises AssetError if a mesh cannot
    be read.
    """
    tree = UrdfTree.of_text(urdf)
    shapes = LinkShapes(tree, Path("robot.urdf"), AssetFiles(Path(Path.cwd().anchor)))
    parts = {name: tuple(shapes.visual(link, np.eye(4))) for name, link in tree.links.items()}
    return {name: found for name, found in parts.items() if found}


@lru_cache(maxsize=4)
def link_drawables(
    urdf: str, tolerance_m: float, fine_m: float, fingers: frozenset[str] = frozenset()
) -> dict[str, Drawable]:
    """Return the links with visual meshes, ready for rendering, simplified by about a tolerance; cached on disk.

    Links in ``fingers``, which a camera on the hand sees from nearby, are simplified by ``fine_m``. Raises AssetError if a
    mesh cannot be read.
    """
    kept = _kept_file(urdf, tolerance_m, fine_m, fingers)
    found = None if kept is None else _read(kept)
    if found is not None:
        return found
    made = {
        link: prepare_drawable(parts, tolerance_m=fine_m if link in fingers else tolerance_m, hidden_left_out=True)
        for link, parts in link_visuals(urdf).items()
    }
    content = None if kept is None else drawables_to_bytes(made)
    if kept is not None and content is not None:
        _write(kept, content)
    return made


def looks_folder() -> Path:
    """Return ``$XDG_CACHE_HOME/manitwin/robot_looks``, ``~/.cache`` by default (XDG Base Directory Specification)."""
    return cache_home() / "robot_looks"


def _kept_file(urdf: str, tolerance_m: float, fine_m: float, fingers: frozenset[str]) -> Path | None:
    """Return the cache file of a robot's appearance, named by the digest of all inputs; None if that cannot be determined.

    None for other mesh formats, whose colours may be in separate files.
    """
    digest = hashlib.sha256(json.dumps([LOOKS_VERSION, tolerance_m, fine_m, sorted(fingers), urdf]).encode())
    try:
        for mesh in UrdfTree.of_text(urdf).element.iterfind("./link/visual/geometry/mesh"):
            path = Path(mesh.get("filename").removeprefix("file://"))
            if path.suffix.lower() not in WHOLE_FILES:
                return None
            digest.update(hashlib.sha256(path.read_bytes()).digest())
        return looks_folder() / f"{digest.hexdigest()}.npz"
    except (OSError, RuntimeError):  # unreadable mesh, which is reported when it is loaded; or no home folder
        return None


def _read(path: Path) -> dict[str, Drawable] | None:
    """Return the cached appearance; None if it is missing or damaged, in which case it is recreated."""
    try:
        with path.open("rb") as stream:
            return drawables_from_bytes(stream.read(MOST_BYTES))
    except (OSError, ValueError):
        return None


def _write(path: Path, content: bytes) -> None:
    try:
        write_bytes_atomically(path, content)
    except (OSError, UsageError) as error:  # the appearance is usable without the cache
        RUN.warning("%s: a robot's looks are not kept (%s); look at the folder and the disk", path, error)
