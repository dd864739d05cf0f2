"""Notes of slicers in a 3MF archive: pieces that only help printing, and filament colours.

PrusaSlicer keeps all pieces of an object in one mesh and notes their triangle ranges (``Slic3r_PE_model.config``); Bambu Studio
and OrcaSlicer make each piece a component (``model_settings.config``).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from itertools import zip_longest

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.errors import InputError
from manitwin.formats.json_file import parse_json
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.three_mf_model import color_of
from manitwin.formats.meshes.three_mf_package import ThreeMfPackage
from manitwin.formats.xml_file import parse_xml

Color = tuple[int, int, int, int]
_PRUSA_PARTS, _PRUSA_SETTINGS = "/Metadata/Slic3r_PE_model.config", "/Metadata/Slic3r_PE.config"
_BAMBU_PARTS, _BAMBU_SETTINGS = "/Metadata/model_settings.config", "/Metadata/project_settings.config"
_MATTER = frozenset({"ModelPart", "normal_part"})
_CUT_OUT = frozenset({"NegativeVolume", "negative_part"})
_FILAMENTS = "filament_colour"
_MOST_FILAMENTS = 256


@dataclass(frozen=True)
class TriangleRange:
    """Triangles ``first`` to ``last`` of an object's mesh: a piece of some ``kind``, printed by an ``extruder`` (from 1)."""

    first: int
    last: int
    kind: str
    extruder: int | None


@dataclass
class SlicerNotes:
    """The notes of one archive; ids are those of objects and their components. Empty for other archives."""

    ranges: dict[int, list[TriangleRange]] = field(default_factory=dict)
    kinds: dict[tuple[int, int], str] = field(default_factory=dict)
    extruders: dict[tuple[int, int], int] = field(default_factory=dict)
    objects: dict[int, int] = field(default_factory=dict)
    filaments: list[Color | None] = field(default_factory=list)

    def is_print_aid(self, object_id: int, part_id: int, source: MeshSource) -> bool:
        """Return whether a component of an object only helps printing; if so, add a finding."""
        kind = self.kinds.get((object_id, part_id), "normal_part")
        _add_left_out_finding(kind, source)
        return kind not in _MATTER

    def is_product(self, part_id: int, count: int, source: MeshSource) -> np.ndarray:
        """Return which (F,) of an object's ``count`` triangles belong to the product, with a finding on the others."""
        is_matter = np.ones(count, bool)
        for each in self.ranges.get(part_id, []):
            if each.kind not in _MATTER:
                _add_left_out_finding(each.kind, source)
                is_matter[each.first : each.last + 1] = False
        return is_matter

    def colors(self, object_id: int, part_id: int, count: int, default: np.ndarray) -> np.ndarray:
        """Return the filament colours (F, 4) uint8 sRGB of ``count`` triangles, ``default`` if unknown."""
        whole = self.extruders.get((object_id, part_id), self.objects.get(object_id))
        colors = np.broadcast_to(self._filament(whole, default), (count, 4)).copy()
        for each in self.ranges.get(part_id, []):
            if each.extruder is not None:
                colors[each.first : each.last + 1] = self._filament(each.extruder, default)
        return colors

    def _filament(self, extruder: int | None, default: np.ndarray) -> np.ndarray:
        if extruder is None or not 1 <= extruder <= len(self.filaments):
            return default
        color = self.filaments[extruder - 1]
        return default if color is None else np.array(color, np.uint8)


def read_notes(package: ThreeMfPackage, source: MeshSource) -> SlicerNotes:
    """Return a slicer's notes in a package; raises InputError ``unreadable`` if they are broken."""
    notes = SlicerNotes()
    for name in (_PRUSA_PARTS, _BAMBU_PARTS):
        text = package.text(name)
        if text is None:
            continue
        root = parse_xml(text, "config", source.name, refusal=partial(InputError, "unreadable"))
        for each in root.iter("object"):
            _read_object(each, notes)
    prusa, bambu = package.text(_PRUSA_SETTINGS), package.text(_BAMBU_SETTINGS)
    notes.filaments = _bambu_colors(bambu, source) if prusa is None else _prusa_colors(prusa)
    return notes


def _read_object(element: etree._Element, notes: SlicerNotes) -> None:
    number = int(element.get("id", "0"))
    extruder = _metadata(element, "extruder")
    if extruder is not None:
        notes.objects[number] = int(extruder)
    for volume in element.iter("volume"):
        extruder = _metadata(volume, "extruder")
        is_modifier = _metadata(volume, "modifier") == "1"  # before PrusaSlicer 1.42
        kind = _metadata(volume, "volume_type") or ("ParameterModifier" if is_modifier else "ModelPart")
        piece = TriangleRange(
            max(int(volume.get("firstid", "0")), 0),
            max(int(volume.get("lastid", "-1")), -1),
            kind,
            None if extruder is None else int(extruder),
        )
        notes.ranges.setdefault(number, []).append(piece)
    for part in element.iter("part"):
        key = number, int(part.get("id", "0"))
        notes.kinds[key] = part.get("subtype", "normal_part")
        extruder = _metadata(part, "extruder")
        if extruder is not None:
            notes.extruders[key] = int(extruder)


def _metadata(element: etree._Element, key: str) -> str | None:
    """Return a metadata value of an element itself, excluding nested elements."""
    return next((each.get("value") for each in element.iterchildren("metadata") if each.get("key") == key), None)


def _prusa_colors(text: bytes) -> list[Color | None]:
    """Return the colour of each extruder: its own if one is set, else that of its filament."""
    lines = text.decode("utf-8", "replace").splitlines()
    settings = {key.strip("; "): value.strip() for key, _, value in (line.partition("=") for line in lines)}
    own, filaments = (_colors(settings.get(name, "").split(";")) for name in ("extruder_colour", _FILAMENTS))
    return [color or filament for color, filament in zip_longest(own, filaments)]


def _bambu_colors(text: bytes | None, source: MeshSource) -> list[Color | None]:
    if text is None:
        return []
    tree = parse_json(text.decode("utf-8", "replace"), source.name, partial(InputError, "unreadable"))
    named = tree.get(_FILAMENTS) if isinstance(tree, dict) else None
    return _colors([str(each) for each in named]) if isinstance(named, list) else []


def _colors(texts: list[str]) -> list[Color | None]:
    """Return the parsed colours, with None for an empty or invalid one to keep the indices."""
    return [_color(text) for text in texts[:_MOST_FILAMENTS]]


def _color(text: str) -> Color | None:
    try:
        return color_of(text) if text.strip() else None
    except ValueError:
        return None


def _add_left_out_finding(kind: str, source: MeshSource) -> None:
    if kind in _CUT_OUT:
        source.add_finding(
            "pieces in it that a slicer cuts out of the thing were left out, and so were the holes that they make"
        )
    elif kind not in _MATTER:
        source.add_finding("pieces in it that only tell a slicer how to print were left out")
