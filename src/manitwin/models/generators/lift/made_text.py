"""A text to a finished job: the template that it names, made."""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.errors import Unsupported, UsageError
from manitwin.formats.glb import write_glb
from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.generators.lift.made_photo import Job
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.known import known_of
from manitwin.models.generators.templates.made import Made, visual_parts
from manitwin.models.generators.templates.making import make
from manitwin.models.generators.templates.text import read_text


def why_not(text: str) -> str | None:
    """Return why no template makes what a text asks for; None where one does."""
    try:
        made_as_read(text, 0)
    except (UsageError, SolidError) as error:
        return str(error)
    return None


def made_as_read(text: str, seed: int) -> tuple[Made, tuple[str, ...]]:
    """Return what a text asks for as the plain reader reads it, and the words that say nothing to it.

    Raises UsageError for a text that names no category, a size that no such thing has or a part that it has not, SolidError
    for measures that give no solid.
    """
    templates = load_templates()
    wanted = read_text(text, templates)
    return make(templates[wanted.category], wanted, np.random.default_rng(seed)), wanted.unused


def from_text(text: str, seed: int) -> Job:
    """Return what a text asks for; raises Unsupported where no template makes it."""
    try:
        made, unused = made_as_read(text, seed)
    except (UsageError, SolidError) as error:
        raise Unsupported(str(error)) from error
    return job_of(made, text, unused)


def job_of(made: Made, text: str, unused: tuple[str, ...]) -> Job:
    """Return a made thing with what is known of it."""
    notes: dict[str, Any] = {
        "primitive": f"template:{made.category}",
        "category": made.category,
        "measures": {name: round(value, 6) for name, value in made.measures.items()},
        "materials": {part: look.material for part, look in made.looks.items()},
        "masses_kg": {part: round(mass, 6) for part, mass in made.masses_kg.items()},
        "unused_words": list(unused),
    }
    return Job(write_glb(visual_parts(made)), notes, None, known_of(made, text), metric=True)
