"""3D generation of a mesh from the matted photo or a text (paper, "3D Generation")."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from PIL import Image

from manitwin.config import GenerateConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.models.generators.generated_mesh import convert_to_glb
from manitwin.models.generators.protocol import GenerationRequest, Generator, PhotoView
from manitwin.models.generators.run import run_generator
from manitwin.pipeline.human_corrections import name_by_person
from manitwin.pipeline.item import Item
from manitwin.pipeline.object_state import likely_names, object_name
from manitwin.pipeline.photo_groups import distinct_names
from manitwin.pipeline.stated_poses import StatedPoses, poses_of


class GenerateStage:
    """Generate a mesh from the photo or text. Writes ``generated.glb`` and the field ``generation``."""

    name: ClassVar[str] = "generate"
    version: ClassVar[str] = "49"
    reads: ClassVar[tuple[str, ...]] = ("photo.png?", "photos/?", "matte?", "naming?")
    writes: ClassVar[tuple[str, ...]] = ("generated.glb", "generation")

    def __init__(self, settings: GenerateConfig, generator: Generator, submit_again: bool = False):
        """Take the settings and the generator; ``submit_again``: repeat a submission of unknown outcome, which may be charged
        twice.
        """
        self.settings, self._submit_again = settings, submit_again
        self.generator = generator
        self.backend: str = generator.name
        self.model: str | None = generator.model
        self.needs: Resource = generator.needs
        # a generator that calls a vision-language model is charged per token, and states its expected cost
        self.expected_usd: float = getattr(generator, "expected_usd", generator.usd_per_job)

    def run(self, draft: Draft[Item], folder: Path) -> dict[str, Any]:
        """Generate the mesh. Raises Rejected ``generator_failed``, or BackendError if the generator is not available now."""
        rgba = np.asarray(Image.open(draft.path("photo.png"))) if "photo.png" in draft.paths else None
        poses = poses_of(draft.payload)
        views = read_views(draft, poses)
        takes_views = getattr(self.generator, "takes_views", False)
        request = GenerationRequest(
            rgba=rgba,
            text=draft.payload.text,
            name=object_name(draft),
            seed=generator_seed(draft),
            guessed=name_by_person(draft) is None,
            views=views if takes_views else (),
            focal_mm=draft.field("matte")["focal_mm"] if "matte" in draft.fields else None,
            likely=likely_names(draft),
            unit_m=None if poses is None else poses.unit_m,
        )
        made = run_generator(
            self.generator, request, folder, settings=self.settings, jobs=draft.jobs, submit_again=self._submit_again
        )
        content = convert_to_glb(made.path)
        made.path.unlink()
        (folder / "generated.glb").write_bytes(content)
        used = len(views) - len(made.notes.get("left_out", [])) if takes_views else 1
        photos: dict[str, Any] = {"photos": {"cut_out": len(views), "used": used}} if views else {}
        if poses is not None and views:
            photos["poses"] = {"file": poses.file, "up": poses.up.said, "unit": poses.unit_said, "metric": made.metric}
        return {
            "generation": {
                "generator": self.generator.name,
                "model": made.model,
                "metric": made.metric,
                "rests": made.rests,
                "unseen_share": made.unseen_share,
                "notes": made.notes | photos,
                "known": None if made.known is None else made.known.model_dump(mode="json"),
            }
        }


def read_views(draft: Draft[Item], poses: StatedPoses | None = None) -> tuple[PhotoView, ...]:
    """Return the cut-outs of several photos of one object, with stated turns or poses; empty if fewer than two are left."""
    pictures = sorted(draft.path("photos/").glob("*.png")) if "photos/" in draft.paths else []
    if len(pictures) < 2:
        return ()
    files = draft.payload.files
    turns = draft.payload.turns_deg if poses is None else poses.turns_deg
    names = distinct_names(files)
    focals_mm = draft.field("matte")["focals_mm"]
    return tuple(
        PhotoView(
            name=names[number],
            rgba=np.asarray(Image.open(picture)),
            turn_deg=turns[number] if turns else None,
            focal_mm=focal_mm,
            pose=None if poses is None else poses.cameras[number],
        )
        for picture, focal_mm in zip(pictures, focals_mm, strict=True)
        for number in [int(picture.stem)]
    )


def generator_seed(draft: Draft[Item]) -> int:
    """Return the run's seed; for a further variation of a text, a 31-bit seed mixed from both."""
    if not draft.payload.variation:
        return draft.seed
    return int(np.random.SeedSequence([draft.seed, draft.payload.variation]).generate_state(1)[0] >> 1)
