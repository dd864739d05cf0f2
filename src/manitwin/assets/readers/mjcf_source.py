"""An MJCF file brought to what describes objects: includes put in, everything else taken out, nothing opened by MuJoCo."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset_files import AssetFiles
from manitwin.errors import AssetError
from manitwin.formats.xml_file import MAX_NUMBER, comments_before, read_xml

_SECTIONS = frozenset({"compiler", "default", "asset", "worldbody"})
_ASSETS = frozenset({"mesh", "material", "texture"})
# plug-ins are code, and the others make many bodies of one line
_NOT_READ = ("attach", "composite", "flexcomp", "plugin", "replicate", "model")
_WORDS = frozenset({"name", "file", "mesh", "material", "texture", "class", "childclass", "model", "user"})
_MAX_INCLUDES = 32
_MAX_ELEMENTS = 100_000


@dataclass(frozen=True)
class MjcfSource:
    """The XML that MuJoCo is given, and what was taken from it.

    ``texts`` are the comments at its head, and those of <custom> as ``name: data``.
    """

    file: Path
    root: etree._Element
    texts: tuple[str, ...]

    def writes(self, attributes: tuple[str, ...]) -> bool:
        """Tell whether a geom, or a default for geoms, writes one of these attributes."""
        return any(geom.get(name) is not None for geom in self.root.iter("geom") for name in attributes)


def open_mjcf(file: Path, files: AssetFiles) -> MjcfSource:
    """Parse an MJCF file and put its includes in; raises AssetError for what is broken or not read."""
    root = read_xml(file, "mujoco")
    comments = comments_before(root)
    _put_in_includes(file, root, files)
    if sum(1 for _ in root.iter()) > _MAX_ELEMENTS:
        raise AssetError(f"{file.name}: more than {_MAX_ELEMENTS} elements; it is no single object")
    for tag in _NOT_READ:
        if root.find(f".//{tag}") is not None:
            raise AssetError(f"{file.name}: it uses <{tag}>, which is not read; write it out as bodies and geoms")
    texts = (*comments, *(f"{t.get('name')}: {t.get('data')}" for t in root.iterfind("custom/text")))
    for section in list(root):
        if section.tag not in _SECTIONS:
            root.remove(section)
    for entry in root.xpath("asset/*"):
        if entry.tag not in _ASSETS:
            entry.getparent().remove(entry)
    for element in root.iter(etree.Element):
        _check_numbers(file, element)
    return MjcfSource(file, root, texts)


def _put_in_includes(file: Path, root: etree._Element, files: AssetFiles) -> None:
    """Replace <include> by the children of the included root, as MuJoCo does; each file once."""
    done: set[Path] = {file.resolve()}
    while (include := root.find(".//include")) is not None:
        name = include.get("file") or ""
        found = files.find(name, [file.parent / name])
        if found is None:
            raise AssetError(f"{file.name}: the file {name[:80]!r} that it includes is not in its folder")
        if found in done or len(done) > _MAX_INCLUDES:
            raise AssetError(f"{file.name}: includes {name[:80]!r} twice, or too many files")
        done.add(found)
        tag = "mujocoinclude" if b"<mujocoinclude" in found.read_bytes()[:65536] else "mujoco"
        included = read_xml(found, tag)
        parent, position = include.getparent(), include.getparent().index(include)
        parent.remove(include)
        for offset, child in enumerate(list(included)):
            parent.insert(position + offset, child)


def _check_numbers(file: Path, element: etree._Element) -> None:
    for name, text in element.attrib.items():
        if name in _WORDS:
            continue
        for word in text.split():
            try:
                value = float(word)
            except ValueError:
                break
            if not math.isfinite(value) or abs(value) > MAX_NUMBER:
                raise AssetError(f"{file.name}: <{element.tag} {name}> is {value}, no number that an object can have")
