"""Read a photo and cut its object out of the background (paper, "3D Generation": background removal, resolution)."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from PIL import Image

from manitwin.config import MattingConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import InputError
from manitwin.formats.image_file import read_image
from manitwin.models.matting import matte_photo
from manitwin.models.matting.learned import Network
from manitwin.pipeline.item import Item


class PhotoStage:
    """Write ``photo.png`` (RGBA, upright, alpha is the matte) and the field ``matte``."""

    name: ClassVar[str] = "photo"
    version: ClassVar[str] = "3"
    reads: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[tuple[str, ...]] = ("photo.png", "matte")
    needs: ClassVar[Resource] = "cpu"

    def __init__(self, settings: MattingConfig, network: Network | None = None):
        """Take the settings, and the network that they name: it decides by its content, wherever its file is."""
        self.settings = settings.model_copy(update={"network": None})
        self.network = network
        self.backend: str = "classical" if network is None else "classical+learned"
        self.model: str | None = None if network is None else network.model

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
            network=self.network,
        )
        Image.fromarray(np.ascontiguousarray(matte.rgba)).save(folder / "photo.png", compress_level=3)
        field: dict[str, Any] = {
            "method": matte.method,
            "confidence": matte.confidence,
            "findings": [*photo.findings, *matte.findings],
            "scores": matte.scores,
            "agreement": matte.agreement,
        }
        if self.network is not None:
            field["network"] = {
                "name": self.network.name,
                "sha256": self.network.sha256,
                "source": self.network.source,
                "licence": self.network.licence,
            }
        return {"matte": field}
