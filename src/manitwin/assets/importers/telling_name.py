"""What an imported asset is called: its own name, or that of its file or folder where its own says nothing."""

from __future__ import annotations

import re
from pathlib import Path

_SAYS_NOTHING = frozenset({
    "asset", "base", "body", "collision", "default", "env", "export", "exported", "geometry", "link", "main", "mesh",
    "meshes", "mjcf", "model", "mujoco", "myfirst", "obj", "object", "physics", "robot", "root", "scene", "sdf", "sim",
    "simulation", "stage", "textured", "unnamed", "untitled", "urdf", "usd", "visual", "world", "xform", "xml",
})  # fmt: skip
"""Words that tools write where nobody named anything: USD's World, obj2mjcf's textured, MuJoCo's default, ROS's tutorials."""
_BETWEEN_WORDS = re.compile(r"(?<=[a-z]{2})(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z]{2})")
_FOLDERS_UP = 1
_OF_A_FILE = re.compile(r"(.+)\.(?:urdf|sdf|xml|mjcf|obj|stl|dae|usda?)", re.IGNORECASE)
"""A name that is a file's, which authors leave as it is where they copy one: CLIPort's pallet.urdf is called cube.urdf."""


def telling_name(name: str, path: Path) -> str:
    """Return an asset's own name; that of its file, else of its folder, where its own says nothing of what it is.

    A name that is a file's says nothing but where it is this file's. Of several names none of which says anything, its own.
    So it is with the name of another file around it, which a description was copied from: PyBullet's plate.urdf is called cube.
    """
    place = path.resolve()
    if _is_of_another_file(name, place):
        return place.stem
    of_a_file = _OF_A_FILE.fullmatch(name)
    if of_a_file is not None:
        name = of_a_file[1]
        if place.suffix and _says_something(place.stem):
            return place.stem
    others = [
        place.stem if place.suffix else place.name,
        *(parent.name for parent in list(place.parents)[:_FOLDERS_UP]),
    ]
    return next((each for each in (name, *others) if _says_something(each)), name)


def _is_of_another_file(name: str, place: Path) -> bool:
    """Tell whether a file of that name lies beside a description or in the folder above, and its own name shares no word."""
    own, named = set(_words(place.stem)), set(_words(name))
    if not place.suffix or not named or own & named or not _says_something(place.stem) or Path(name).name != name:
        return False
    folders = (place.parent, *list(place.parent.parents)[:_FOLDERS_UP])
    return any((folder / f"{name}{place.suffix}").is_file() for folder in folders)


def split_words(name: str) -> str:
    """Return a name with spaces between words that capitals alone tell apart: CoffeeTable, TVCabinet, YcbBanana."""
    return _BETWEEN_WORDS.sub(" ", name)


def _says_something(name: str) -> bool:
    return any(word not in _SAYS_NOTHING for word in _words(name))


def _words(name: str) -> list[str]:
    words = (re.sub(r"\d+", "", word) for word in re.findall(r"[^\W_]+", name.lower()))
    return [word for word in words if word]
