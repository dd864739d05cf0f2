"""Job for a text: builds the template that it names."""

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
    """Return why no template can make a text; None if one can."""
    try:
        made_as_read(text, 0)
    except (UsageError, SolidError) as error:
        return str(error)
    return None


def made_as_read(text: str, seed: int) -> tuple[Made, tuple[str, ...]]:
    """Return the object described by a text, as the rule-based reader understands it, and the words that it ignored.

    Raises UsageError for a text without a known category, with an impossible size or with a part that the object does not
    have; SolidError for measures that give no solid.
    """
    templates = load_templates()
    wanted = read_text(text, templates)
    return make(templates[wanted.category], wanted, np.random.default_rng(seed)), wanted.unused


def from_text(text: str, seed: int) -> Job:
    """Return the object described by a text; raises Unsupported if no template can make it."""
    try:
        made, unused = made_as_read(text, seed)
    except (UsageError, SolidError) as error:
        raise Unsupported(str(error)) from error
    return job_of(made, text, unused)


def job_of(made: Made, text: str, unused: tuple[str, ...]) -> Job:
    """Return the job of a built object with its known properties."""
    notes: dict[str, Any] = {
        "primitive": f"template:{made.category}",
        "category": made.category,
        "measures": {name: round(value, 6) for name, value in made.measures.items()},
        "materials": {part: look.material for part, look in made.looks.items()},
        "masses_kg": {part: round(mass, 6) for part, mass in made.masses_kg.items()},
        "unused_words": list(unused),
    }
    return Job(write_glb(visual_parts(made)), notes, None, known_of(made, text), metric=True)
