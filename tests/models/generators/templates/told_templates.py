"""Texts read for the templates of the package, and what is made of them."""

from __future__ import annotations

from manitwin.models.generators.lift.text_generation import make_from_text
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import ObjectDescription, read_text
from manitwin.models.generators.templates.look_phrases import LookRequest
from manitwin.models.generators.templates.template_object import TemplateObject

TEMPLATES = load_templates()


def read(text: str) -> ObjectDescription:
    """Return what a text asks for."""
    return read_text(text, TEMPLATES)


def whole(text: str) -> LookRequest:
    """Return what a text asks for of the whole thing."""
    return read(text).wishes.get("", LookRequest())


def made_of(text: str) -> TemplateObject:
    """Return what is made of a text, of the first seed."""
    return make_from_text(text, 0)[0]
