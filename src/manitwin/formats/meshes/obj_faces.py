"""The faces of an OBJ text, lines of corners ``v/vt/vn``: read all at once where they are plain, one by one elsewhere."""

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
    """The faces of one material: per polygon its corner count, per corner its 0-based v, vt and vn index (-1: none)."""

    source: MeshSource
    _waiting: list[tuple[int, str, str]] = field(default_factory=list)  # number and text of a line, and its corners
    _waiting_sizes: list[int] = field(default_factory=list)
    _sizes: list[int] = field(default_factory=list)  # of what was read one by one last
    _corners: list[tuple[int, int, int]] = field(default_factory=list)
    _blocks: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)  # sizes and corners before these
    _known: dict[str, tuple[int, int, int]] = field(default_factory=dict)

    def add(self, number: int, line: str, said: str, size: int, counts: tuple[int, int, int]) -> None:
        """Add the ``size`` corners that are ``said`` in a line; ``counts`` are of the v, vt and vn before it.

        Raises InputError ``unreadable`` naming the line where it is no face; also ``rows`` may, of a line that was added.
        """
        if "-" in said:  # counts back from here
            self._read_waiting()
            self._read_one(number, line, said, counts)
        else:
            self._waiting.append((number, line, said))
            self._waiting_sizes.append(size)

    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the polygons' corner counts ``(P,)`` and the corners ``(sum, 3)``; both empty where no face has three."""
        self._read_waiting()
        self._end_block()
        if not self._blocks:
            return np.zeros(0, np.int64), np.zeros((0, 3), np.int64)
        sizes, corners = zip(*self._blocks, strict=True)
        return np.concatenate(sizes), np.concatenate(corners)

    def _read_waiting(self) -> None:
        if not self._waiting:
            return
        sizes = np.array(self._waiting_sizes)
        corners = plain_corners(" ".join(said for _, _, said in self._waiting)) if sizes.min() >= 3 else None
        if corners is not None and len(corners) == sizes.sum():
            self._end_block()
            self._blocks.append((sizes, corners))
        else:
            for number, line, said in self._waiting:
                self._read_one(number, line, said, (0, 0, 0))  # none counts back
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
        """Return the 0-based indices of ``v/vt/vn``; negative numbers count back from the last line so far."""
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
    """Return the 0-based indices ``(N, 3)`` of corners that are all ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``; None of others."""
    if not _PLAIN.fullmatch(text):
        return None
    words = text.split()
    slashes = {word.count("/") for word in words}
    without_uv = text.count("//") == len(words)
    if len(slashes) != 1 or max(slashes) > 2 or (without_uv and slashes != {2}):
        return None
    columns = [0, 2] if without_uv else list(range(max(slashes) + 1))
    values = np.fromstring(text.replace("/", " "), dtype=np.int64, sep=" ")  # what is too large becomes the largest
    if len(values) != len(columns) * len(words) or values.min() < 1 or values.max() > MOST_INDEX:
        return None
    corners = np.full((len(words), 3), NO_INDEX, np.int64)
    corners[:, columns] = values.reshape(-1, len(columns)) - 1
    return corners
