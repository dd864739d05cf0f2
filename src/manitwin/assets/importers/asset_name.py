"""Name of an imported asset: from its file's content, or from the file or folder if that name is generic or copied."""

from __future__ import annotations

import re
from pathlib import Path

_SAYS_NOTHING = frozenset({
    "asset", "base", "body", "collision", "default", "env", "export", "exported", "geometry", "link", "main", "mesh",
    "meshes", "mjcf", "model", "mujoco", "myfirst", "obj", "object", "physics", "robot", "root", "scene", "sdf", "sim",
    "simulation", "stage", "textured", "unnamed", "untitled", "urdf", "usd", "visual", "world", "xform", "xml",
})  # fmt: skip
"""Generic words that tools write for unnamed objects: USD's World, obj2mjcf's textured, MuJoCo's default, ROS tutorials."""
_BETWEEN_WORDS = re.compile(r"(?<=[a-z]{2})(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z]{2})")
_FOLDERS_UP = 1
_OF_A_FILE = re.compile(r"(.+)\.(?:urdf|sdf|xml|mjcf|obj|stl|dae|usda?)", re.IGNORECASE)
"""A declared name that ends like a file name. Authors copy files and leave it unchanged: CLIPort's pallet.urdf says cube.urdf."""


def informative_name(name: str, path: Path) -> str:
    """Return the name of an asset at ``path``: the declared ``name``, if it is informative.

    Otherwise it is the first informative name of the file and its folder, or else the declared ``name``. A declared name that
    was copied from another file is ignored: one that ends like a file name (``_OF_A_FILE``), or that is the name of a file
    beside this one (PyBullet's plate.urdf says cube, and cube.urdf lies beside it).
    """
    place = path.resolve()
    if _names_other_file(name, place):
        return place.stem
    of_a_file = _OF_A_FILE.fullmatch(name)
    if of_a_file is not None:
        name = of_a_file[1]
        if place.suffix and _is_informative(place.stem):
            return place.stem
    others = [
        place.stem if place.suffix else place.name,
        *(parent.name for parent in list(place.parents)[:_FOLDERS_UP]),
    ]
    return next((each for each in (name, *others) if _is_informative(each)), name)


def _names_other_file(name: str, place: Path) -> bool:
    """Return whether a name is that of a file in the same or parent folder and shares no word with the name of its own file."""
    own, named = set(_words(place.stem)), set(_words(name))
    if not place.suffix or not named or own & named or not _is_informative(place.stem) or Path(name).name != name:
        return False
    folders = (place.parent, *list(place.parent.parents)[:_FOLDERS_UP])
    return any((folder / f"{name}{place.suffix}").is_file() for folder in folders)


def split_words(name: str) -> str:
    """Insert spaces between words that only capitals separate: CoffeeTable, TVCabinet, YcbBanana."""
    return _BETWEEN_WORDS.sub(" ", name)


def _is_informative(name: str) -> bool:
    return any(word not in _SAYS_NOTHING for word in _words(name))


def _words(name: str) -> list[str]:
    words = (re.sub(r"\d+", "", word) for word in re.findall(r"[^\W_]+", name.lower()))
    return [word for word in words if word]
