"""Paper, Asset Generation: a 3D generator turns the matted photo, or a text, into a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from PIL import Image

from manitwin.config import GenerateConfig, Resource
from manitwin.models.generators.protocol import GenerationRequest, Generator
from manitwin.models.generators.run import run_generator
from manitwin.stages.stage import Draft


class GenerateStage:
    """Write ``generated.glb`` and the field ``generation``."""

    name: ClassVar[str] = "generate"
    version: ClassVar[str] = "2"
    reads: ClassVar[tuple[str, ...]] = ("photo.png?",)
    writes: ClassVar[tuple[str, ...]] = ("generated.glb", "generation")

    def __init__(self, settings: GenerateConfig, generator: Generator):
        self.settings = settings
        self.generator = generator
        self.backend: str = generator.name
        self.model: str | None = generator.model
        self.needs: Resource = generator.needs

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Generate; raises Rejected ``generator_failed``, or BackendError where the generator cannot work now."""
        rgba = np.asarray(Image.open(draft.path("photo.png"))) if "photo.png" in draft.paths else None
        request = GenerationRequest(rgba=rgba, text=draft.item.text, name=draft.item.name, seed=draft.seed)
        made = run_generator(self.generator, request, folder, max_wait_s=self.settings.max_wait_s)
        made.path.replace(folder / "generated.glb")
        return {
            "generation": {
                "generator": self.generator.name,
                "model": made.model,
                "metric": made.metric,
                "rests": made.rests,
                "notes": made.notes,
            }
        }
