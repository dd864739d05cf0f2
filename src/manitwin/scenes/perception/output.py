"""File output of a perception data set."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from manitwin.formats.label_picture import label_picture
from manitwin.twin.store import canonical_json

JPEG_QUALITY = 95


class Output:
    """Writes files below a folder by name; ``written`` counts them."""

    def __init__(self, folder: Path):
        self._folder, self.written = folder, 0

    def write_bytes(self, name: str, content: bytes) -> None:
        """Write a file, making its parent folders if needed."""
        path = self._folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        self.written += 1

    def write_json(self, name: str, content: Any) -> None:
        """Write canonical JSON: equal values give the same bytes."""
        self.write_bytes(name, canonical_json(content).encode())

    def write_picture(self, name: str, picture: Image.Image, form: str) -> None:
        """Write a picture as PNG, or as JPEG without chroma subsampling."""
        stream = io.BytesIO()
        options = {"quality": JPEG_QUALITY, "subsampling": 0} if form == "JPEG" else {}
        picture.save(stream, form, **options)
        self.write_bytes(name, stream.getvalue())

    def write_labels(self, name: str, numbers: np.ndarray) -> None:
        """Write integers ``(H, W)`` as a PNG of 8 or 16 bits."""
        self.write_bytes(name, label_picture(numbers))

    def write_arrays(self, name: str, arrays: dict[str, np.ndarray]) -> None:
        """Write arrays as a compressed .npz file."""
        stream = io.BytesIO()
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]  # numpy's stub takes names for its own flags
        self.write_bytes(name, stream.getvalue())
