"""Naming of unnamed objects from their photo or from rendered views."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from PIL import Image

from manitwin.config import NamingConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.geometry.boxes import upright_extents
from manitwin.models.classifiers.classifier import Classification, classify
from manitwin.models.classifiers.efficientnet_lite import NAME, WEIGHTS_SHA256
from manitwin.pipeline.item import Item
from manitwin.pipeline.object_state import object_name, pictures
from manitwin.render.background_colors import foreground_mask
from manitwin.twin.record import Likely, Naming

VIEWS_FROM_ABOVE = (0, 1, 2, 4, 5, 6)
"""Indices of the views from above, as people see objects on a table (``ORBIT_ELEVATIONS_DEG``)."""


class NameStage:
    """Classify an unnamed object. Writes the field ``naming``; None if a person has named it."""

    name: ClassVar[str] = "name"
    version: ClassVar[str] = "7"
    reads: ClassVar[tuple[str, ...]] = ("photo.png?", "photos/?", "views/?", "canonical.npz?", "geometry?")
    writes: ClassVar[tuple[str, ...]] = ("naming",)
    needs: ClassVar[Resource] = "cpu"
    backend: ClassVar[str] = NAME
    model: ClassVar[str | None] = WEIGHTS_SHA256[:16]

    def __init__(self, settings: NamingConfig):
        self.settings = settings

    def run(self, draft: Draft[Item], folder: Path) -> dict[str, Any]:
        """Classify the object. Raises Unavailable without the classifier's weights."""
        if object_name(draft) is not None or not self.settings.enabled:
            return {"naming": None}
        if "photos/" in draft.paths:
            shown = [np.asarray(Image.open(picture)) for picture in sorted(draft.path("photos/").glob("*.png"))]
        elif "photo.png" in draft.paths:
            shown = [np.asarray(Image.open(draft.path("photo.png")))]
        else:
            views = pictures(draft.path("views/"), "rgb")
            shown = [cut_view(np.asarray(Image.open(views[i]).convert("RGB"))) for i in VIEWS_FROM_ABOVE]
        named = classify(shown, self.settings.min_probability, known_length_m(draft))
        return {"naming": to_record(named).model_dump(mode="json")}


def known_length_m(draft: Draft[Item]) -> float | None:
    """Return the longest side (m) of an upright mesh; None for a photo, and for a mesh of unknown unit."""
    if "canonical.npz" not in draft.paths:
        return None
    geometry = draft.field("geometry")
    if not geometry["metric"] or geometry["units"] == "guessed":
        return None
    with np.load(draft.path("canonical.npz")) as solid:
        return float(upright_extents(solid["vertices"]).max())


def cut_view(picture: np.ndarray) -> np.ndarray:
    """Return a view ``(H, W, 3) uint8`` of a mesh as RGBA ``(H, W, 4)``, opaque where it differs from the plain background."""
    away = foreground_mask(picture)
    alpha = away if away.any() else np.ones_like(away)
    return np.dstack([picture, np.where(alpha, 255, 0).astype(np.uint8)])


def to_record(named: Classification) -> Naming:
    """Return the record of a name for twin.json."""
    return Naming(
        name=named.name,
        probability=named.probability,
        likeliest=[Likely(name=guess.name, probability=guess.probability.value) for guess in named.likeliest],
    )
