"""Read a photo and cut its object out of the background (paper, "3D Generation": background removal, resolution)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from PIL import Image

from manitwin.config import MattingConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import InputError
from manitwin.formats.image_file import read_image
from manitwin.models.matting import matte_photo
from manitwin.pipeline.item import Item


@dataclass(frozen=True)
class PhotoStage:
    """Write ``photo.png`` (RGBA, upright, alpha is the matte) and the field ``matte``."""

    settings: MattingConfig

    name: ClassVar[str] = "photo"
    version: ClassVar[str] = "2"
    reads: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[tuple[str, ...]] = ("photo.png", "matte")
    needs: ClassVar[Resource] = "cpu"
    backend: ClassVar[str] = "classical"
    model: ClassVar[str | None] = None

    def run(self, draft: Draft[Item], folder: Path) -> dict[str, Any]:
        """Read and matte; raises InputError, or Rejected where no single object can be told from the background."""
        if draft.payload.file is None:
            raise InputError("empty", "no image file; give one")
        path, settings = Path(draft.payload.file), self.settings
        photo = read_image(path, frame=settings.frame, max_side_px=settings.photo_side_px)
        matte = matte_photo(
            photo.pixels,
            path.name,
            working_side_px=settings.working_side_px,
            min_confidence=settings.min_confidence,
            min_area_share=settings.min_area_share,
            second_object_share=settings.second_object_share,
        )
        Image.fromarray(np.ascontiguousarray(matte.rgba)).save(folder / "photo.png", compress_level=3)
        return {
            "matte": {
                "method": matte.method,
                "confidence": matte.confidence,
                "findings": [*photo.findings, *matte.findings],
                "scores": matte.scores,
            }
        }
