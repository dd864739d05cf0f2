"""Describe category, color, material, size, shape and function in words (paper, "Semantic Captioning")."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from manitwin.config import NO_SETTINGS, Resource
from manitwin.engine.stage import Draft
from manitwin.models.annotators.protocol import Annotator
from manitwin.pipeline.human_corrections import corrected_language
from manitwin.pipeline.object_state import read_scaled_subject


class CaptionStage:
    """Ask the annotator for words."""

    name: ClassVar[str] = "caption"
    version: ClassVar[str] = "5"
    reads: ClassVar[tuple[str, ...]] = (
        "visual.glb",
        "solid.npz",
        "physical",
        "size",
        "called",
        "views/",
        "cameras",
        "geometry?",
        "naming?",
    )
    writes: ClassVar[tuple[str, ...]] = ("language",)

    settings = NO_SETTINGS

    def __init__(self, annotator: Annotator):
        self._annotator = annotator
        self.backend = annotator.name
        self.model = annotator.model_for("captions")
        self.needs: Resource = annotator.needs
        self.expected_usd = annotator.expected_usd("captions")

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Return ``language``."""
        physical = draft.field("physical")
        subject = read_scaled_subject(draft, known_as=draft.field("called"))
        language = self._annotator.describe(subject, physical["material"], np.array(physical["extents_m"]))
        return {"language": corrected_language(language, draft).model_dump()}
