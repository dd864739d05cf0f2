"""Descriptions of category, color, material, size, shape and function (paper, "Semantic Captioning")."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

from manitwin.config import NO_SETTINGS, Resource
from manitwin.engine.stage import Draft
from manitwin.geometry.boxes import extents_along_sides
from manitwin.models.annotators.photo_light import PhotoLight, estimate_mean_light
from manitwin.models.annotators.protocol import Annotator
from manitwin.pipeline.human_corrections import corrected_language
from manitwin.pipeline.item import Item
from manitwin.pipeline.object_state import cut_out_photos, read_scaled_subject


class CaptionStage:
    """Get the object's descriptions from the annotator. Field: ``language``."""

    name: ClassVar[str] = "caption"
    version: ClassVar[str] = "23"
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
        "photo.png?",
        "photos/?",
        "matte?",
        "generation?",
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
        """Return the field ``language``."""
        material = draft.field("physical")["material"]
        subject = read_scaled_subject(draft, known_as=draft.field("called"))
        subject = replace(subject, photographed=is_photographed(draft), light=light_of_texture(draft))
        # as measured with a ruler, since a mesh may be oblique to its axes
        extents_m = extents_along_sides(subject.solid.vertices)
        language = self._annotator.describe(subject, material, extents_m)
        return {"language": corrected_language(language, draft).model_dump()}


def is_photographed(draft: Draft[Item]) -> bool:
    """Return whether the mesh's texture is its photo itself, which is only the case for ``lift``."""
    return (draft.fields.get("generation") or {}).get("generator") == "lift"


def light_of_texture(draft: Draft[Item]) -> PhotoLight | None:
    """Return the illumination of the photos that form the mesh's texture; None for other meshes, or if it is unknown.

    With a given alpha channel there is no background to estimate it from.
    """
    if not is_photographed(draft) or (draft.fields.get("matte") or {}).get("method", "alpha") == "alpha":
        return None
    return estimate_mean_light(cut_out_photos(draft))
