"""Faces of an OBJ text, lines of corners ``v/vt/vn``: parsed all at once if regular, otherwise one by one."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from manitwin.formats.meshes.source import MeshSource

MOST_INDEX = 2**31
NO_INDEX = -1
_PLAIN = re.compile(r"[0-9/ ]+")


@dataclass
class Faces:
    """The faces of one material: the corner count of each polygon, and 0-based v, vt and vn indices of each corner (-1: none)."""

    source: MeshSource
    _waiting: list[tuple[int, str, str]] = field(default_factory=list)  # line number, line, and its corners
    _waiting_sizes: list[int] = field(default_factory=list)
    _sizes: list[int] = field(default_factory=list)  # of the faces parsed one by one last
    _corners: list[tuple[int, int, int]] = field(default_factory=list)
    _blocks: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)  # sizes and corners of earlier faces
    _known: dict[str, tuple[int, int, int]] = field(default_factory=dict)

    def add(self, number: int, line: str, said: str, size: int, counts: tuple[int, int, int]) -> None:
        """Add the ``size`` corners in the text ``said`` of a line; ``counts`` are the numbers of v, vt and vn before it.

        Raises InputError ``unreadable`` naming a line that is not a face; ``rows`` may raise it too, for a line added earlier.
        """
        if "-" in said:  # relative to the current counts
            self._parse_pending()
            self._read_one(number, line, said, counts)
        else:
            self._waiting.append((number, line, said))
            self._waiting_sizes.append(size)

    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the corner counts ``(P,)`` of polygons and the corners ``(sum, 3)``; both empty if no face has three corners."""
        self._parse_pending()
        self._end_block()
        if not self._blocks:
            return np.zeros(0, np.int64), np.zeros((0, 3), np.int64)
        sizes, corners = zip(*self._blocks, strict=True)
        return np.concatenate(sizes), np.concatenate(corners)

    def _parse_pending(self) -> None:
        if not self._waiting:
            return
        sizes = np.array(self._waiting_sizes)
        corners = plain_corners(" ".join(said for _, _, said in self._waiting)) if sizes.min() >= 3 else None
        if corners is not None and len(corners) == sizes.sum():
            self._end_block()
            self._blocks.append((sizes, corners))
        else:
            for number, line, said in self._waiting:
                self._read_one(number, line, said, (0, 0, 0))  # none of them is relative
        self._waiting, self._waiting_sizes = [], []

    def _end_block(self) -> None:
        if self._sizes:
            self._blocks.append((np.array(self._sizes), np.array(self._corners)))
            self._sizes, self._corners = [], []

    def _read_one(self, number: int, line: str, said: str, counts: tuple[int, int, int]) -> None:
        known = self._known.get
        try:
            corners = [known(word) or self._corner(word, counts) for word in said.split()]
        except ValueError as error:
            raise self.source.unreadable(f"line {number} is not a face: {line[:60]!r}", "export it again") from error
        if len(corners) >= 3:  # else a point or a line written as a face
            self._sizes.append(len(corners))
            self._corners.extend(corners)

    def _corner(self, word: str, counts: tuple[int, int, int]) -> tuple[int, int, int]:
        """Return the 0-based indices of ``v/vt/vn``; negative numbers are relative to the current counts."""
        fields = word.split("/")
        indices = [NO_INDEX, NO_INDEX, NO_INDEX]
        relative = False
        for i, text in enumerate(fields[:3]):
            if text == "" and i > 0:
                continue
            value = int(text)
            if value == 0 or value < -counts[i] or value > MOST_INDEX:
                raise ValueError(word)
            relative = relative or value < 0
            indices[i] = value - 1 if value > 0 else counts[i] + value
        corner = (indices[0], indices[1], indices[2])
        if not relative:
            self._known[word] = corner
        return corner


def plain_corners(text: str) -> np.ndarray | None:
    """Return the 0-based indices ``(N, 3)`` of corners all written as ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``; else None."""
    if not _PLAIN.fullmatch(text):
        return None
    words = text.split()
    slashes = {word.count("/") for word in words}
    without_uv = text.count("//") == len(words)
    if len(slashes) != 1 or max(slashes) > 2 or (without_uv and slashes != {2}):
        return None
    columns = [0, 2] if without_uv else list(range(max(slashes) + 1))
    # numbers that are too large become the largest
    values = np.fromstring(text.replace("/", " "), dtype=np.int64, sep=" ")
    if len(values) != len(columns) * len(words) or values.min() < 1 or values.max() > MOST_INDEX:
        return None
    corners = np.full((len(words), 3), NO_INDEX, np.int64)
    corners[:, columns] = values.reshape(-1, len(columns)) - 1
    return corners
