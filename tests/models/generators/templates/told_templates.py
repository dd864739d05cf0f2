"""Texts read for the templates of the package, and what is made of them."""

from __future__ import annotations

from manitwin.models.generators.lift.made_text import made_as_read
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.described import Wish
from manitwin.models.generators.templates.made import Made
from manitwin.models.generators.templates.text import Wanted, read_text

TEMPLATES = load_templates()


def read(text: str) -> Wanted:
    """Return what a text asks for."""
    return read_text(text, TEMPLATES)


def whole(text: str) -> Wish:
    """Return what a text asks for of the whole thing."""
    return read(text).wishes.get("", Wish())


def made_of(text: str) -> Made:
    """Return what is made of a text, of the first seed."""
    return made_as_read(text, 0)[0]
