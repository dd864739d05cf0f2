"""The object as the annotator's questions see it, read from what earlier stages left."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from manitwin.engine.stage import Draft
from manitwin.formats.glb import read_glb
from manitwin.geometry.poses import OBJECT_TO_GLTF
from manitwin.models.annotators.protocol import PhysicalEstimates, SelectedPoints, Subject
from manitwin.pipeline.item import Item
from manitwin.pipeline.object_arrays import load_solid
from manitwin.render.cameras import Camera
from manitwin.twin.import_record import ImportRecord, read_import_record


def read_subject(draft: Draft[Item], *, solid: str, visual: str, metric: bool, scale: float = 1.0) -> Subject:
    """Read the subject of a draft; ``solid`` and ``visual`` name the artifacts that hold the meshes.

    ``scale`` is how much larger these are than the canonical mesh, which the views were taken of.
    """
    return Subject(
        name=draft.payload.name,
        solid=load_solid(draft.path(solid)),
        parts=tuple(read_glb(draft.path(visual))),
        metric=metric,
        views=pictures(draft.path("views/"), "rgb"),
        cameras=tuple(Camera.from_json(value).scaled(scale) for value in draft.field("cameras")),
        seed=draft.seed,
        given=read_given(draft),
    )


def read_given(draft: Draft[Item]) -> ImportRecord | None:
    """Return what an imported asset gives, moved as the mesh stage moved its mesh; None for every other input."""
    if draft.payload.given is None:
        return None
    record = read_import_record(Path(draft.payload.given))
    return record.moved(np.array(draft.field("geometry")["input_to_object"]) @ OBJECT_TO_GLTF)


def pictures(folder: Path, kind: str) -> tuple[Path, ...]:
    """Return the eight pictures of a kind ('rgb', 'marked') in the order of their numbers."""
    return tuple(sorted(folder.glob(f"{kind}_*.webp")))


def findings_of(answer: PhysicalEstimates | SelectedPoints) -> list[str] | None:
    """Return what still spoke against an answer when it was given again; None: nobody looked."""
    return None if answer.findings is None else list(answer.findings)
