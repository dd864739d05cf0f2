"""What an imported asset is called: the name in its file, or that of the file or folder where the one inside says nothing."""

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
"""A name inside that ends as a file's does. Authors copy files and leave it there: CLIPort's pallet.urdf says cube.urdf."""


def telling_name(name: str, path: Path) -> str:
    """Return what an asset at ``path`` is called: the ``name`` inside, where that says what it is.

    Else the name of the file, else of its folder, whichever first says anything; where none does, the ``name`` inside. A name
    that was copied with another file counts for nothing: one that ends as a file's does (``_OF_A_FILE``), or that is the name of
    a file beside this one (PyBullet's plate.urdf says cube, and cube.urdf lies beside it).
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
    """Tell whether a name is that of a file beside ``place`` or in the folder above, and has no word of its own file's name."""
    own, named = set(_words(place.stem)), set(_words(name))
    if not place.suffix or not named or own & named or not _says_something(place.stem) or Path(name).name != name:
        return False
    folders = (place.parent, *list(place.parent.parents)[:_FOLDERS_UP])
    return any((folder / f"{name}{place.suffix}").is_file() for folder in folders)


def split_words(name: str) -> str:
    """Return a name with spaces between words that only capitals divide: CoffeeTable, TVCabinet, YcbBanana."""
    return _BETWEEN_WORDS.sub(" ", name)


def _says_something(name: str) -> bool:
    return any(word not in _SAYS_NOTHING for word in _words(name))


def _words(name: str) -> list[str]:
    words = (re.sub(r"\d+", "", word) for word in re.findall(r"[^\W_]+", name.lower()))
    return [word for word in words if word]
