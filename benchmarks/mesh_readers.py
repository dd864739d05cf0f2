"""Compare the results of two readers for the same models: `python benchmarks/mesh_readers.py FOLDER OTHER`.

Files with the same name except for the suffix, below two folders (such as the glTF and the FBX of a kit), are read and compared
up to a common factor of length: bounds and area within 0.1 %, and whether they have textures. Prints how many agree, and the
differences of each pair that does not.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.meshes.textures import material_of
from manitwin.formats.source_files import MESH_SUFFIXES

LIKE = 1e-3


@dataclass(frozen=True)
class Measured:
    """Measured properties of a file: ``low`` and ``high`` corners ``(3,)`` and ``area`` in its own unit, and textures."""

    low: np.ndarray
    high: np.ndarray
    area: float
    textured: bool

    @property
    def longest(self) -> float:
        """Longest side of the bounding box, in the file's unit."""
        return float((self.high - self.low).max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("other", type=Path)
    given = parser.parse_args()
    theirs = meshes(given.other)
    counts, factors = Counter[str](), Counter[str]()
    for name, file in sorted(meshes(given.folder).items()):
        if name not in theirs:
            counts["without the other"] += 1
            continue
        try:
            one, other = measured(file), measured(theirs[name])
        except InputError as error:
            counts["not read"] += 1
            print(f"  {name}: {error}")
            continue
        differs = differences(one, other)
        counts["differ" if differs else "alike"] += 1
        factors[f"{other.longest / one.longest:.4g}"] += 1
        if differs:
            print(f"  {name}: {', '.join(differs)} differ")
    print(", ".join(f"{count} {what}" for what, count in counts.most_common()))
    print("factors of length: " + ", ".join(f"{count} x {factor}" for factor, count in factors.most_common()))


def meshes(folder: Path) -> dict[str, Path]:
    """Return the mesh files below a folder by their names without suffix."""
    return {path.stem: path for path in sorted(folder.rglob("*")) if path.suffix.lower() in MESH_SUFFIXES}


def measured(path: Path) -> Measured:
    """Read a file and measure it."""
    parts = read_mesh(path).parts
    return Measured(
        np.min([part.bounds[0] for part in parts], axis=0),
        np.max([part.bounds[1] for part in parts], axis=0),
        float(sum(part.area for part in parts)),
        any(material_of(part).baseColorTexture is not None for part in parts),
    )


def differences(one: Measured, other: Measured) -> list[str]:
    """Return the properties in which two files differ, up to a factor of length."""
    factor = other.longest / one.longest
    off = LIKE * other.longest
    found = []
    if not (
        np.allclose(other.low, factor * one.low, atol=off) and np.allclose(other.high, factor * one.high, atol=off)
    ):
        found.append("bounds")
    if abs(other.area / (factor**2 * one.area) - 1) > LIKE:
        found.append("areas")
    if one.textured != other.textured:
        found.append("textures")
    return found


if __name__ == "__main__":
    main()
