"""Layer dependencies of USD text files, found without the USD library."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from manitwin.errors import AssetError
from manitwin.formats.bounded_file import open_regular

USD_SUFFIXES = frozenset({".usd", ".usda", ".usdc", ".usdz"})
USD_TEXT = b"#usda"
_TEXT_BYTES = 1 << 23
_SUBLAYERS = re.compile(rb"^\s*subLayers\s*=\s*\[([^\]]*)\]", re.MULTILINE)
_ROOT_PRIM = re.compile(rb"^def\b[^\n(]*\((.*?)^\)", re.MULTILINE | re.DOTALL)
"""The metadata of a root prim, which USD writes up to a bracket that begins a line."""
_PAYLOAD = re.compile(rb"\bpayload\s*=\s*(\[[^\]]*\]|@[^@\n]*@)")
_NAMED = re.compile(rb"@([^@\n]+)@")


def layers_of(files: Iterable[Path], root: Path) -> set[Path]:
    """Return the resolved files below ``root`` that are layers of the given files, hence parts of an asset and no assets.

    These are the sublayers of a USD text, the payloads of its root prims, and every file that such a layer names. References of
    prims below the root prims are not followed: they are assets of which a scene is composed.
    """
    inside, found = root.resolve(), set[Path]()
    waiting = [each for file in files for each in _named_by(file, layer=False)]
    while waiting:
        layer = waiting.pop()
        if layer not in found and layer.is_relative_to(inside):
            found.add(layer)
            waiting += _named_by(layer, layer=True)
    return found


def _named_by(file: Path, *, layer: bool) -> Iterator[Path]:
    """Yield the USD files that a text names as its own layers; for a ``layer``, all files that it names."""
    if file.suffix.lower() not in USD_SUFFIXES or not file.is_file():
        return
    with open_regular(file, AssetError) as stream:
        text = stream.read(_TEXT_BYTES)
    if not text.startswith(USD_TEXT):
        return
    parts = (
        [text]
        if layer
        else [*_SUBLAYERS.findall(text), *(p for root in _ROOT_PRIM.findall(text) for p in _PAYLOAD.findall(root))]
    )
    for named in (each for part in parts for each in _NAMED.findall(part)):
        path = Path(named.decode("utf-8", "replace"))
        if path.suffix.lower() in USD_SUFFIXES and not path.is_absolute() and "\0" not in str(path):
            try:
                target = (file.parent / path).resolve()
            except (OSError, RuntimeError, ValueError):  # a loop of links, or a name that no file system can hold
                continue
            if target != file.resolve():
                yield target
