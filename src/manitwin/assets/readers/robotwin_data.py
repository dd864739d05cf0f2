"""RoboTwin's ``model_data<ID>.json``: frames and their descriptions, in the spellings of all versions."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.assets.asset import AnnotatedFrame, FrameKind
from manitwin.errors import AssetError
from manitwin.formats.json_file import read_json_object

MAX_FRAMES = 10_000
LARGEST = 1e6  # metres or scale factor: larger values are invalid for an object
FRAME_KEYS: dict[FrameKind, tuple[str, ...]] = {
    "contact": ("contact_points_pose", "contact_pose"),
    "functional": ("functional_matrix",),
    "target": ("target_pose",),
    "orientation": ("orientation_point",),
}
"""Keys of each kind of frame: first that of RoboTwin 2.0, then those of 1.0."""

_WORDS = {"contact": "contact_points", "functional": "functional_point", "target": "target_point"}
_SPELLINGS = ("description", "discription")  # files shipped until 2026 have the second spelling
_ARTICULATED = ("contact_points", "functional_points", "target_points")


@dataclass
class RobotwinData:
    """Content of one file; empty if it does not exist, as in RoboTwin's loader.

    ``remarks`` are findings on the content, one line each.
    """

    file: Path
    content: dict[str, Any]
    remarks: list[str] = field(default_factory=list)

    @classmethod
    def read(cls, file: Path) -> RobotwinData:
        """Read a file; raises AssetError if it is not a JSON object, or describes an articulated object."""
        content = read_json(file)
        articulated = [key for key in _ARTICULATED if key in content]
        if articulated or isinstance(content.get("mass"), dict):
            raise AssetError(
                f"{file.name}: {articulated[0] if articulated else 'a mass by link'} is of an articulated object; only rigid"
                " ones are read"
            )
        return cls(file, content)

    @property
    def scale(self) -> np.ndarray:
        """The scale ``(3,)`` of meshes and of the translations of all frames; 1 by default."""
        given = self.content.get("scale", 1.0)
        numbers = self._numbers("scale", given)
        if numbers.size not in (1, 3):
            raise self._asset_error("scale", "is neither a number nor three")
        return np.broadcast_to(numbers.reshape(-1), 3).copy()

    def frames(self) -> tuple[AnnotatedFrame, ...]:
        """Return all frames as written, without orthonormalization, with scaled translations.

        For contact frames, approach is minus the second axis and closing the third axis. Raises AssetError for anything but 4x4
        matrices of finite numbers.
        """
        found = []
        for kind in FRAME_KEYS:
            matrices = self._matrices(kind)
            labels = self._labels(kind, len(matrices))
            for i, matrix in enumerate(matrices):
                approach, closing = (-matrix[:3, 1], matrix[:3, 2]) if kind == "contact" else (None, None)
                found.append(AnnotatedFrame(kind, i, matrix, labels[i], _unit(approach), _unit(closing)))
        return tuple(found)

    def array(self, key: str, shape: tuple[int, ...]) -> np.ndarray:
        """Return numbers of the file as an array; raises AssetError for another shape, or numbers that are not finite."""
        numbers = self._numbers(key, self.content.get(key))
        if numbers.shape != shape:
            raise self._asset_error(key, f"has the shape {numbers.shape}, not {shape}")
        return numbers

    def text(self, key: str) -> str | None:
        """Return a text of the file, None if absent or empty."""
        value = self.content.get(key)
        return value.strip() or None if isinstance(value, str) else None

    def _matrices(self, kind: FrameKind) -> np.ndarray:
        """Return matrices ``(N, 4, 4)``, with ``trans_matrix`` applied if a key of version 1.0 is used."""
        names = FRAME_KEYS[kind]
        key = next((name for name in names if self.content.get(name) not in (None, [])), None)
        if key is None:
            return np.empty((0, 4, 4))
        matrices = self._numbers(key, self.content[key])
        if matrices.shape == (4, 4):
            matrices = matrices[None]  # 1.0 has a single matrix where 2.0 has a list
        if matrices.ndim != 3 or matrices.shape[1:] != (4, 4) or len(matrices) > MAX_FRAMES:
            raise self._asset_error(key, f"is no list of 4x4 matrices (shape {matrices.shape})")
        if (matrices[:, 3] != (0, 0, 0, 1)).any():
            self.remarks.append(f"{key}: a matrix whose last row is not 0 0 0 1")
        matrices = matrices.copy()
        matrices[:, :3, 3] *= self.scale
        if key != names[0] and "trans_matrix" in self.content:
            turn = self._numbers("trans_matrix", self.content["trans_matrix"])
            if turn.shape != (4, 4):
                raise self._asset_error("trans_matrix", "is no 4x4 matrix")
            matrices = matrices @ turn  # RoboTwin 1.0: actor @ scaled(contact_pose) @ trans_matrix
        return matrices

    def _labels(self, kind: FrameKind, count: int) -> list[str]:
        word = _WORDS.get(kind, "orientation_point")
        given: Any = next((self.content[f"{word}_{s}"] for s in _SPELLINGS if self.content.get(f"{word}_{s}")), [])
        texts = [str(text) for text in (given if isinstance(given, list) else [given])]
        labels = texts + [""] * (count - len(texts))
        if kind != "contact":
            return labels
        groups = self._groups(count)
        if len(texts) < count and len(texts) == len(groups):  # one description for each group
            for text, group in zip(texts, groups, strict=True):
                for i in group:
                    labels[i] = text
        return labels

    def _groups(self, count: int) -> list[list[int]]:
        """Return the groups of contacts, without indices of contacts that do not exist."""
        groups = self.content.get("contact_points_group") or []
        if not isinstance(groups, list) or not all(isinstance(group, list) for group in groups):
            raise self._asset_error("contact_points_group", "is no list of lists")
        wrong = [i for group in groups for i in group if not isinstance(i, int) or not 0 <= i < count]
        if wrong:
            self.remarks.append(f"contact_points_group: no contact {wrong[0]!r}, there are {count}")
        mask = self.content.get("contact_points_mask")
        if isinstance(mask, list) and len(mask) != len(groups):
            self.remarks.append(f"contact_points_mask: {len(mask)} values for {len(groups)} groups")
        return [[i for i in group if isinstance(i, int) and 0 <= i < count] for group in groups]

    def _numbers(self, key: str, value: Any) -> np.ndarray:
        try:
            numbers = np.array(value, dtype=float)
        except (TypeError, ValueError, OverflowError) as error:
            raise self._asset_error(key, "is not made of numbers") from error
        if not np.isfinite(numbers).all() or (np.abs(numbers) > LARGEST).any():
            raise self._asset_error(key, "holds a number that is not finite, or beyond a million")
        return numbers

    def _asset_error(self, key: str, what: str) -> AssetError:
        return AssetError(f"{self.file.name}: {key} {what}; correct it there")


def read_json(file: Path) -> dict[str, Any]:
    """Read a JSON object from a file, empty if the file does not exist; raises AssetError for anything else."""
    return read_json_object(file, inside=file.parent) if os.path.lexists(file) else {}


def _unit(vector: np.ndarray | None) -> np.ndarray | None:
    """Normalize a direction; return None for None and for a zero vector."""
    length = 0.0 if vector is None else float(np.linalg.norm(vector))
    return None if vector is None or length < 1e-9 else vector / length
