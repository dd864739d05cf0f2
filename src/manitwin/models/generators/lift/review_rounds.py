"""Two rounds of review by a model: it compares an object with its input, corrects it once, and compares again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np
import trimesh

from manitwin.errors import Rejected
from manitwin.formats.image_file import png_of
from manitwin.models.annotators.vlm.template_likeness import FIRST_LOOK, Likeness
from manitwin.models.annotators.vlm.template_reader import MODEL_VIEWS, TemplateReader
from manitwin.models.generators.lift.photo_generation import LiftResult
from manitwin.models.generators.templates.filled_template import FilledTemplate
from manitwin.models.generators.templates.look_phrases import LookRequest
from manitwin.models.vlm.protocol import Picture
from manitwin.render.background_colors import background_for
from manitwin.render.cameras import framing_camera
from manitwin.render.renderer import BACKDROP, shared_renderer

T = TypeVar("T")
FOV_Y_DEG = 30.0
MOST_QUOTE_CHARACTERS = 400  # maximum characters of a model's text in a message


@dataclass(frozen=True)
class ReviewResult(Generic[T]):
    """The object that is kept, whether the model finally calls it right, its text in each round, and the findings."""

    final: T
    accepted: bool
    rounds: tuple[str, ...]
    findings: tuple[str, ...]


def review_twice(
    first: T, compare: Callable[[T, str], Likeness], correct: Callable[[T, FilledTemplate], tuple[T, str]]
) -> ReviewResult[T]:
    """Return the object that is kept after a model may correct it once.

    ``compare`` asks about an object, with a line about the previous round; ``correct`` returns the object that is kept after
    a correction, and a sentence that says which one it is.
    """
    look = compare(first, FIRST_LOOK)
    if look.right:
        return ReviewResult(first, True, (look.detail,), look.findings)
    kept, words = correct(first, look.corrected)
    said = " ".join(look.detail.split())[:MOST_QUOTE_CHARACTERS]
    again = compare(kept, f"You saw it before and said: {said!r}. {words} This is the last look.")
    return ReviewResult(kept, again.right, (look.detail, again.detail), look.findings + again.findings)


def require_accepted(agreed: ReviewResult[Any], what: str, reader: TemplateReader) -> None:
    """Raise Rejected if the model calls an object wrong in both rounds."""
    if not agreed.accepted:
        words = "; then: ".join(" ".join(said.split())[:MOST_QUOTE_CHARACTERS] for said in agreed.rounds)
        raise Rejected(
            "generator_failed",
            f"lift: {reader.chat.model} says in both rounds that this is not what was given ({what}): {words}; name it with"
            " --name, or choose another generator",
            "generate",
        )


def add_review_notes(
    job: LiftResult,
    reader: TemplateReader,
    filled: FilledTemplate | None,
    findings: Sequence[str],
    agreed: ReviewResult[Any] | None = None,
) -> LiftResult:
    """Return a job with a record of the model's answers; ``filled`` is None if it chose none of the templates."""
    said = filled or FilledTemplate("")
    notes = {
        "source": reader.source,
        "category": said.category or None,
        "measures": {name: round(value, 6) for name, value in said.measures.items()},
        "looks": {part: _look(wish) for part, wish in said.wishes.items()},
        "rounds": [] if agreed is None else list(agreed.rounds),
        "right": None if agreed is None else agreed.accepted,
        "findings": list(findings),
    }
    return replace(job, notes={**job.notes, "filled": notes})


def _look(wish: LookRequest) -> dict[str, str | None]:
    rgb = None if wish.rgb is None else "#" + "".join(f"{round(255 * channel):02x}" for channel in wish.rgb)
    return {"color": rgb, "material": None if wish.material is None else wish.material.material}


def render_review_pictures(
    parts: Sequence[trimesh.Trimesh], front_deg: float, elevation_deg: float, side_px: int
) -> list[str | Picture]:
    """Return captions and pictures of an object in the object frame, from the given azimuth and from two other sides."""
    points = np.concatenate([part.vertices for part in parts])
    sides = [
        (front_deg + turn, elevation_deg if turn == 0 else 25.0) for turn in np.arange(MODEL_VIEWS) * 360 / MODEL_VIEWS
    ]
    cameras = [
        framing_camera(
            points,
            azimuth_deg=azimuth,
            elevation_deg=elevation,
            fov_y_deg=FOV_Y_DEG,
            width_px=side_px,
            height_px=side_px,
        )
        for azimuth, elevation in sides
    ]
    frames = shared_renderer().render(list(parts), cameras)
    ground = background_for(frames)
    shown: list[str | Picture] = []
    for number, frame in enumerate(frames):
        where = (
            "from where the photo was taken, or the front"
            if number == 0
            else f"turned by {number * 360 // MODEL_VIEWS} degrees"
        )
        shown += [f"The model, {where}:", Picture(png_of(frame.composited_over(BACKDROP, ground)))]
    return shown
