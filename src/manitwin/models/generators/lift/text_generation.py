"""Job for a text: builds the template that it names."""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.errors import Unsupported, UsageError
from manitwin.formats.glb import write_glb
from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.generators.lift.photo_generation import LiftResult
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.ground_truth import object_import_record
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template_object import TemplateObject, visual_parts


def unsupported_reason(text: str) -> str | None:
    """Return why no template can make a text; None if one can."""
    try:
        make_from_text(text, 0)
    except (UsageError, SolidError) as error:
        return str(error)
    return None


def make_from_text(text: str, seed: int) -> tuple[TemplateObject, tuple[str, ...]]:
    """Return the object described by a text, as the rule-based reader understands it, and the words that it ignored.

    Raises UsageError for a text without a known category, with an impossible size or with a part that the object does not
    have; SolidError for measures that give no solid.
    """
    templates = load_templates()
    wanted = read_text(text, templates)
    return make_object(templates[wanted.category], wanted, np.random.default_rng(seed)), wanted.unused


def generate_from_text(text: str, seed: int) -> LiftResult:
    """Return the object described by a text; raises Unsupported if no template can make it."""
    try:
        made, unused = make_from_text(text, seed)
    except (UsageError, SolidError) as error:
        raise Unsupported(str(error)) from error
    return text_result(made, text, unused)


def text_result(made: TemplateObject, text: str, unused: tuple[str, ...]) -> LiftResult:
    """Return the job of a built object with its known properties."""
    notes: dict[str, Any] = {
        "primitive": f"template:{made.category}",
        "category": made.category,
        "measures": {name: round(value, 6) for name, value in made.measures.items()},
        "materials": {part: look.material for part, look in made.looks.items()},
        "masses_kg": {part: round(mass, 6) for part, mass in made.masses_kg.items()},
        "unused_words": list(unused),
    }
    return LiftResult(write_glb(visual_parts(made)), notes, None, object_import_record(made, text), metric=True)
