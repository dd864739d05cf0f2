"""Parser of material scripts of OGRE, the renderer of Gazebo: colours and textures."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

_TOKEN = re.compile(r'"[^"\n]*"|[{}]|[^\s{}"]+')
_COMMENT = re.compile(r"/\*|(?<!:)//")
_MOST_COLORS = 4
_PLAIN_SECTIONS = frozenset({"technique", "pass", "texture_unit"})


@dataclass(frozen=True)
class OgreMaterial:
    """Appearance of one material: the first pass of its first technique, and the first texture of that pass.

    ``diffuse`` is sRGB with alpha ``(4,)`` in 0..1, None if not stated. ``texture`` is a file name. ``scale`` is the size of
    the texture in texture coordinates. ``blended``: it is drawn with alpha blending. ``cut_at``: alpha threshold in 0..1 below
    which nothing is drawn.
    """

    diffuse: tuple[float, ...] | None = None
    texture: str | None = None
    scale: tuple[float, float] = (1.0, 1.0)
    blended: bool = False
    cut_at: float | None = None


def ogre_materials(text: str) -> dict[str, OgreMaterial]:
    """Return the materials of a script by name, with values inherited from earlier materials of the same script.

    Malformed statements, shaders and variables are skipped. Source: the OGRE manual, "Material scripts".
    """
    found: dict[str, OgreMaterial] = {}
    lines = _lines(_without_comments(text))
    for words in lines:
        opened = _opens(words, lines)
        if words[0] == "material" and len(words) > 1 and opened:
            name, parent = _name_and_parent(words[1:])
            found[name] = _material(lines, found.get(parent, OgreMaterial()))
        elif opened:
            _skip(lines)
    return found


class _Lines(Iterator[list[str]]):
    """The statements of a script in order: the words of a line, with each brace separate."""

    def __init__(self, lines: list[list[str]]):
        self._lines, self._at = lines, 0

    def __next__(self) -> list[str]:
        if self._at >= len(self._lines):
            raise StopIteration
        self._at += 1
        return self._lines[self._at - 1]

    def opens(self) -> bool:
        """Return whether the next statement is an opening brace, and skip it if so."""
        there = self._at < len(self._lines) and self._lines[self._at] == ["{"]
        self._at += there
        return there


def _without_comments(text: str) -> str:
    """Return a script without comments; an unclosed comment extends to the end."""
    kept, at = [], 0
    while (comment := _COMMENT.search(text, at)) is not None:
        kept.append(text[at : comment.start()])
        end = text.find("\n" if comment[0] == "//" else "*/", comment.end())
        if end < 0:
            return " ".join(kept)
        at = end if comment[0] == "//" else end + 2
    return " ".join([*kept, text[at:]])


def _lines(text: str) -> _Lines:
    statements: list[list[str]] = []
    for line in text.splitlines():
        words: list[str] = []
        for token in _TOKEN.findall(line):
            if token in "{}":
                statements += [words] if words else []
                statements.append([token])
                words = []
            else:
                words.append(token.strip('"'))
        statements += [words] if words else []
    return _Lines(statements)


def _opens(words: list[str], lines: _Lines) -> bool:
    return words == ["{"] or (words != ["}"] and lines.opens())


def _name_and_parent(words: list[str]) -> tuple[str, str]:
    name, _, parent = " ".join(words).partition(" : ")
    return name.strip(), parent.strip()


def _skip(lines: _Lines) -> None:
    depth = 1
    for words in lines:
        depth += (words == ["{"]) - (words == ["}"])
        if not depth:
            return


def _material(lines: _Lines, material: OgreMaterial) -> OgreMaterial:
    """Parse a material whose section is open; only the first technique, pass and texture count."""
    open_sections: list[str] = []
    seen: set[str] = set()
    for words in lines:
        if words == ["}"]:
            if not open_sections:
                break
            open_sections.pop()
            continue
        if _opens(words, lines):
            if words[0] in seen or words[0] not in _PLAIN_SECTIONS:
                _skip(lines)
            else:
                seen.add(words[0])
                open_sections.append(words[0])
            continue
        if open_sections[-1:] == ["pass"]:
            material = _of_pass(words, material)
        elif open_sections[-1:] == ["texture_unit"]:
            material = _of_texture(words, material)
    return material


def _of_pass(words: list[str], material: OgreMaterial) -> OgreMaterial:
    if words[0] == "diffuse" and (color := _numbers(words[1 : 1 + _MOST_COLORS])) is not None and len(color) >= 3:
        return replace(material, diffuse=tuple(np.clip((*color, 1.0)[:_MOST_COLORS], 0, 1).tolist()))
    if words[0] == "scene_blend" and words[1:2] == ["alpha_blend"]:
        return replace(material, blended=True)
    if words[0] == "alpha_rejection" and words[1:2] in (["greater"], ["greater_equal"]):
        least = _numbers(words[2:3])
        return material if least is None or not len(least) else replace(material, cut_at=min(max(least[0] / 255, 0), 1))
    return material


def _of_texture(words: list[str], material: OgreMaterial) -> OgreMaterial:
    if words[0] == "texture" and len(words) > 1:
        return replace(material, texture=words[1])
    if (
        words[0] == "scale"
        and (size := _numbers(words[1:3])) is not None
        and len(size) == 2
        and min(map(abs, size)) > 0
    ):
        return replace(material, scale=(size[0], size[1]))
    return material


def _numbers(words: list[str]) -> list[float] | None:
    """Return the numbers of words; None if one is not a finite number, such as ``vertexcolour``."""
    try:
        values = [float(word) for word in words]
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None
