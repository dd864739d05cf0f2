"""The built-in generator ``lift``: makes a closed mesh from a matted photo, or from a text that names a known category."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from manitwin.config import Resource
from manitwin.errors import Unavailable
from manitwin.formats.glb import write_glb
from manitwin.models.annotators.vlm.template_reader import TemplateReader
from manitwin.models.generators.lift import text_generation
from manitwin.models.generators.lift.guided_photo import generate_photo_guided
from manitwin.models.generators.lift.guided_text import generate_text_guided
from manitwin.models.generators.lift.multi_view_generation import generate_from_views
from manitwin.models.generators.lift.photo_generation import LiftResult, generate_from_photo
from manitwin.models.generators.protocol import IMAGE_OR_TEXT, Asked, Generated, GenerationRequest, JobState
from manitwin.models.generators.templates.description_parser import MAX_CHARACTERS


class LiftGenerator:
    """Fit the template of a photo's name, or else lift its silhouette; for a text, build the template that it names.

    A photo shows one side and no depth. This generator is meant for tests, demonstrations and machines without a GPU, not for
    comparison with learned generators. ``submit`` does all the work; jobs live as long as this object. With a ``reader`` a
    vision-language model chooses and fills in the template of every photo, and of a text that is not fully understood.
    """

    name = "lift"
    asked_with: frozenset[Asked] = IMAGE_OR_TEXT
    takes_views = True
    usd_per_job = 0.0

    def __init__(self, reader: TemplateReader | None = None) -> None:
        self._reader = reader
        self.model: str | None = None if reader is None else reader.model
        self.needs: Resource = "cpu" if reader is None else "vlm"
        self.expected_usd = 0.0 if reader is None else reader.expected_usd
        self._jobs: dict[str, LiftResult] = {}

    def guided_by(self, reader: TemplateReader) -> LiftGenerator:
        """Return this generator with a model that fills in its templates."""
        return LiftGenerator(reader)

    def why_not(self, text: str) -> str | None:
        """Return why no template can make a text; None if one can, or if a model will be asked."""
        if self._reader is not None and len(text) <= MAX_CHARACTERS:
            return None
        return text_generation.unsupported_reason(text)

    def submit(self, request: GenerationRequest) -> str:
        """Make the mesh; raises Unsupported for a text without a template, Rejected for a photo that ``lift`` cannot make.

        With a reader it also raises the errors of its model, and Rejected if the model says twice that the result is wrong.
        """
        asked = (
            f"{request.seed} {request.text}"
            if request.rgba is None
            else f"{request.name or request.likely} {request.focal_mm}"
        )
        pixels = b"" if request.rgba is None else np.ascontiguousarray(request.rgba).tobytes()
        digest = hashlib.sha256(pixels + asked.encode())
        for view in request.views:
            digest.update(f"{view.turn_deg} {view.focal_mm} {request.unit_m}".encode())
            if view.pose is not None:
                digest.update(f"{view.pose.world_to_camera.tolist()} {view.pose.lens}".encode())
            digest.update(np.ascontiguousarray(view.rgba).tobytes())
        job_id = digest.hexdigest()[:16]
        self._jobs[job_id] = self._made(request)
        return job_id

    def _made(self, request: GenerationRequest) -> LiftResult:
        if request.rgba is None:
            text = request.text or ""
            if self._reader is None:
                return text_generation.generate_from_text(text, request.seed)
            return generate_text_guided(text, request.seed, self._reader)
        if request.views:  # several photos determine the shape without a reader
            made = generate_from_views(request.views, request.name, request.unit_m)
            return LiftResult(write_glb([made.part]), made.notes, made.unseen_share, made.known, made.metric)
        if self._reader is None:
            return generate_from_photo(request.rgba, request.name, request.focal_mm, likely=request.likely)
        return generate_photo_guided(request, self._reader)

    def poll(self, job_id: str) -> JobState:
        """Return ``done``, or ``failed`` if this object does not know the job."""
        if job_id in self._jobs:
            return JobState("done")
        return JobState("failed", f"lift has no job {job_id}: its jobs end with the process; submit it again")

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Write ``lift.glb`` into ``folder``; raises Unavailable for an unknown job."""
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
