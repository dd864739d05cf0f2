"""The built-in generator ``lift``: a matted photo, or the words for a thing of a known category, to a closed mesh."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from manitwin.config import Resource
from manitwin.errors import Rejected, Unavailable, Unsupported, UsageError
from manitwin.formats.glb import write_glb
from manitwin.geometry.poses import GLTF_TO_OBJECT
from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.generators.lift.lifting import Lifted, hint_from_name, lift
from manitwin.models.generators.lift.surface import unseen_share
from manitwin.models.generators.lift.texture import beside
from manitwin.models.generators.protocol import IMAGE_OR_TEXT, Asked, Generated, GenerationRequest, JobState
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.fit import (
    LEAST_AGAINST_INFLATION,
    LEAST_CONFIDENCE,
    LEAST_IOU,
    MOST_OUTLINE,
    Fitted,
    fit,
    kinds_of,
    template_for,
)
from manitwin.models.generators.templates.fitting.generated import (
    known_of_fitted,
    notes_of,
    texture_of,
    visual_part,
)
from manitwin.models.generators.templates.known import known_of
from manitwin.models.generators.templates.made import make, visual_parts
from manitwin.models.generators.templates.template import Template
from manitwin.models.generators.templates.text import Wanted, read_text
from manitwin.twin.import_record import ImportRecord

ROUGHNESS = 0.6


@dataclass(frozen=True)
class _Job:
    glb: bytes
    notes: dict[str, Any]
    unseen_share: float | None
    known: ImportRecord | None = None
    metric: bool = False


class LiftGenerator:
    """Fit the template that a photo's name means, else lift its silhouette; or build the template that a text names.

    Of a photo it sees one side only and no depth: a stand-in for tests, demonstrations and machines without a GPU, not to
    be compared with learned generators. ``submit`` does all the work; jobs live as long as this object.
    """

    name = "lift"
    model: str | None = None
    needs: Resource = "cpu"
    asked_with: frozenset[Asked] = IMAGE_OR_TEXT
    usd_per_job = 0.0

    def __init__(self) -> None:
        self._jobs: dict[str, _Job] = {}

    def why_not(self, text: str) -> str | None:
        """Return why no template makes what a text asks for; None where one does."""
        try:
            make(*_template_and_wish(text), np.random.default_rng(0))
        except (UsageError, SolidError) as error:
            return str(error)
        return None

    def submit(self, request: GenerationRequest) -> str:
        """Make the mesh; raises Unsupported for a text that no template makes, Rejected for what ``lift`` cannot make."""
        if request.rgba is None:
            return self._from_text(request.text or "", request.seed)
        digest = hashlib.sha256(np.ascontiguousarray(request.rgba).tobytes() + (request.name or "").encode())
        job_id = digest.hexdigest()[:16]
        self._jobs[job_id] = _from_photo(request.rgba, request.name)
        return job_id

    def _from_text(self, text: str, seed: int) -> str:
        job_id = hashlib.sha256(f"{seed} {text}".encode()).hexdigest()[:16]
        try:
            template, wanted = _template_and_wish(text)
            made = make(template, wanted, np.random.default_rng(seed))
        except (UsageError, SolidError) as error:
            raise Unsupported(str(error)) from error
        notes = {
            "primitive": f"template:{made.category}",
            "category": made.category,
            "measures": {name: round(value, 6) for name, value in made.measures.items()},
            "materials": {part: look.material for part, look in made.looks.items()},
            "masses_kg": {part: round(mass, 6) for part, mass in made.masses_kg.items()},
            "unused_words": list(wanted.unused),
        }
        self._jobs[job_id] = _Job(write_glb(visual_parts(made)), notes, None, known_of(made, text), metric=True)
        return job_id

    def poll(self, job_id: str) -> JobState:
        """Return ``done``, or ``failed`` where this object does not know the job."""
        if job_id in self._jobs:
            return JobState("done")
        return JobState("failed", f"lift has no job {job_id}: its jobs end with the process; submit it again")

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Write ``lift.glb`` below ``folder``; raises Unavailable for a job that is not known."""
        if job_id not in self._jobs:
            raise Unavailable(self.poll(job_id).message)
        job = self._jobs.pop(job_id)
        path = folder / "lift.glb"
        path.write_bytes(job.glb)
        return Generated(
            path=path,
            model=str(job.notes["primitive"]),
            notes=job.notes,
            metric=job.metric,
            rests=True,
            unseen_share=job.unseen_share,
            known=job.known,
        )


def _from_photo(rgba: np.ndarray, name: str | None) -> _Job:
    """Return the template that the name means where its fit explains the photo, else the photo lifted."""
    template = template_for(name)
    fitted = None if template is None else fit(template.category, rgba, or_of=kinds_of(template.category))
    if fitted is not None and fitted.confidence >= LEAST_CONFIDENCE:
        return _from_fit(fitted, rgba, name)
    try:
        lifted = lift(rgba, hint_from_name(name))
    except Rejected as error:
        if fitted is None:
            raise
        residual = fitted.residual
        raise Rejected(
            error.reason,
            f"{error.detail}; and no {fitted.category} that the template makes has this outline: overlap {residual.iou:.2f}"
            f" (at least {LEAST_IOU}), outlines {residual.outline:.4f} of its length apart (at most {MOST_OUTLINE});"
            " check the name and the cut-out",
            error.stage,
        ) from error
    flat = lifted.notes["primitive"] == "inflation"  # knows nothing of the back
    if fitted is not None and flat and fitted.confidence >= LEAST_AGAINST_INFLATION:
        return _from_fit(fitted, rgba, name)
    notes = lifted.notes if fitted is None else lifted.notes | {"poor_fit": notes_of(fitted)}
    return _Job(write_glb([textured_part(lifted)]), notes, unseen_share(lifted.surface))


def _from_fit(fitted: Fitted, rgba: np.ndarray, name: str | None) -> _Job:
    surface = texture_of(fitted, rgba)
    known = known_of_fitted(fitted, name or fitted.category)
    return _Job(write_glb([visual_part(surface)]), notes_of(fitted), surface.unseen_share, known)


def _template_and_wish(text: str) -> tuple[Template, Wanted]:
    templates = load_templates()
    wanted = read_text(text, templates)
    return templates[wanted.category], wanted


def textured_part(lifted: Lifted) -> trimesh.Trimesh:
    """Return the mesh in the object frame (Z up) with its texture: the photo, and beside it what it does not show."""
    surface, seen = lifted.surface, lifted.surface.seen()
    # a vertex on the border of both has a place in each
    corners = np.where(seen[:, None], surface.faces, surface.faces + len(surface.vertices))
    used, faces = np.unique(corners, return_inverse=True)
    source = used % len(surface.vertices)
    texture, uv = beside(lifted.texture, lifted.unseen, surface.uv[source], used >= len(surface.vertices))
    material = PBRMaterial(
        name="photo",
        baseColorFactor=[255, 255, 255, 255],
        baseColorTexture=Image.fromarray(texture),
        metallicFactor=0.0,
        roughnessFactor=ROUGHNESS,
    )
    vertices = surface.vertices[source] @ GLTF_TO_OBJECT[:3, :3].T
    return trimesh.Trimesh(
        vertices,
        faces.reshape(-1, 3),
        visual=TextureVisuals(uv=uv, material=material),
        process=False,
        metadata={"name": "lift"},
    )
