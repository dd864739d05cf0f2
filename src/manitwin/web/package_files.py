"""Styles and scripts of the pages: files of this package, and three.js extracted from NiceGUI's wheel."""

from __future__ import annotations

import re
from functools import cache
from importlib import resources
from importlib.util import find_spec
from pathlib import Path

from manitwin.errors import Unavailable
from manitwin.formats.bounded_file import read_text
from manitwin.web.html import (
    EPISODE_TIMELINE,
    EPISODE_VIEWER,
    GALLERY,
    OUTLINE,
    REVIEW,
    SCENE_VIEWER,
    STAGE,
    STYLE,
    THREE,
    TRIAL_PLAYER,
    TWIN_SHAPES,
    VIEWER,
)

KINDS = {
    STYLE: "text/css; charset=utf-8",
    **dict.fromkeys(
        (
            THREE,
            VIEWER,
            GALLERY,
            OUTLINE,
            REVIEW,
            STAGE,
            SCENE_VIEWER,
            EPISODE_VIEWER,
            EPISODE_TIMELINE,
            TWIN_SHAPES,
            TRIAL_PLAYER,
        ),
        "text/javascript; charset=utf-8",
    ),
}
"""All files and their content types."""
LICENSE = "three.LICENSE.txt"
_BUNDLE = ("elements", "scene", "dist", "index.js")
_MOST_BYTES = 16 << 20
_WANTED = ("THREE", "GLTFLoader", "OrbitControls")
_EXPORTS = re.compile(r"export\s*\{([^{}]*)\};?\s*(?://# sourceMappingURL=\S*\s*)?\Z")


@cache
def package_file(name: str) -> bytes:
    """Return a file of ``KINDS``, or ``LICENSE``; raises KeyError for another name, Unavailable if three.js is missing."""
    if name == THREE:
        return classic_script(_bundle()).encode()
    if name not in KINDS and name != LICENSE:
        raise KeyError(name)
    return resources.files("manitwin.web").joinpath("static", name).read_bytes()


def classic_script(module: str) -> str:
    """Return NiceGUI's bundle, an ES module, as a classic script that sets ``threeBundle``.

    Browsers load no modules from file URLs, and static files share their pages with the server. Raises Unavailable if the module
    does not end in one export list with the required names.
    """
    found = _EXPORTS.search(module)
    pairs = [part.split() for part in found[1].split(",") if part.strip()] if found else []
    exported = {words[-1]: words[0] for words in pairs if len(words) in (1, 3)}
    if found is None or not set(_WANTED) <= set(exported):
        raise Unavailable(
            "nicegui: its bundle of three.js is not in the form of the version that was locked; install the packages of"
            " requirements.lock"
        )
    wanted = ",".join(f"{name}:{exported[name]}" for name in _WANTED)
    return f'(()=>{{"use strict";\n{module[: found.start()]}\nglobalThis.threeBundle={{{wanted}}};\n}})();\n'


def _bundle() -> str:
    spec = find_spec("nicegui")  # found, not imported: only this file of the package is used
    if spec is None or spec.origin is None:
        raise Unavailable(
            "nicegui: is not installed, and three.js lies in it; install the packages of requirements.lock"
        )
    return read_text(Path(spec.origin).parent.joinpath(*_BUNDLE), _MOST_BYTES, Unavailable, name="three.js of nicegui")
