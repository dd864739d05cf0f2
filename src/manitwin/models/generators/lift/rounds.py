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
from manitwin.models.generators.lift.made_photo import Job
from manitwin.models.generators.templates.described import Wish
from manitwin.models.generators.templates.filled import Filled
from manitwin.models.vlm.protocol import Picture
from manitwin.render.cameras import framing_camera
from manitwin.render.grounds import ground_for
from manitwin.render.renderer import BACKDROP, shared_renderer

T = TypeVar("T")
FOV_Y_DEG = 30.0
MOST_SAID = 400  # maximum characters of a model's text in a message


@dataclass(frozen=True)
class Agreed(Generic[T]):
    """The object that is kept, whether the model finally calls it right, its text in each round, and the findings."""

    kept: T
    right: bool
    rounds: tuple[str, ...]
    findings: tuple[str, ...]


def in_two_rounds(
    first: T, compare: Callable[[T, str], Likeness], correct: Callable[[T, Filled], tuple[T, str]]
) -> Agreed[T]:
    """Return the object that is kept after a model may correct it once.

    ``compare`` asks about an object, with a line about the previous round; ``correct`` returns the object that is kept after
    a correction, and a sentence that says which one it is.
    """
    look = compare(first, FIRST_LOOK)
    if look.right:
        return Agreed(first, True, (look.detail,), look.findings)
    kept, words = correct(first, look.corrected)
    said = " ".join(look.detail.split())[:MOST_SAID]
    again = compare(kept, f"You saw it before and said: {said!r}. {words} This is the last look.")
    return Agreed(kept, again.right, (look.detail, again.detail), look.findings + again.findings)


def require_right(agreed: Agreed[Any], what: str, reader: TemplateReader) -> None:
    """Raise Rejected if the model calls an object wrong in both rounds."""
    if not agreed.right:
        words = "; then: ".join(" ".join(said.split())[:MOST_SAID] for said in agreed.rounds)
        raise Rejected(
            "generator_failed",
            f"lift: {reader.chat.model} says in both rounds that this is not what was given ({what}): {words}; name it with"
            " --name, or choose another generator",
            "generate",
        )


def noted(
    job: Job, reader: TemplateReader, filled: Filled | None, findings: Sequence[str], agreed: Agreed[Any] | None = None
) -> Job:
    """Return a job with a record of the model's answers; ``filled`` is None if it chose none of the templates."""
    said = filled or Filled("")
    notes = {
        "source": reader.source,
        "category": said.category or None,
        "measures": {name: round(value, 6) for name, value in said.measures.items()},
        "looks": {part: _look(wish) for part, wish in said.wishes.items()},
        "rounds": [] if agreed is None else list(agreed.rounds),
        "right": None if agreed is None else agreed.right,
        "findings": list(findings),
    }
    return replace(job, notes={**job.notes, "filled": notes})


def _look(wish: Wish) -> dict[str, str | None]:
    rgb = None if wish.rgb is None else "#" + "".join(f"{round(255 * channel):02x}" for channel in wish.rgb)
    return {"color": rgb, "material": None if wish.material is None else wish.material.material}


def pictures_of(
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
    ground = ground_for(frames)
    shown: list[str | Picture] = []
    for number, frame in enumerate(frames):
        where = (
            "from where the photo was taken, or the front"
            if number == 0
            else f"turned by {number * 360 // MODEL_VIEWS} degrees"
        )
        shown += [f"The model, {where}:", Picture(png_of(frame.over(BACKDROP, ground)))]
    return shown
