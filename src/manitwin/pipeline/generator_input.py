"""Selection of the generator, and detection of inputs that it cannot process, before a build starts."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from manitwin.config import BuildConfig
from manitwin.errors import Unavailable
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.protocol import Annotator
from manitwin.models.generators.protocol import IMAGE_OR_TEXT, Asked, Generator
from manitwin.models.registry import backends, create, factory
from manitwin.pipeline.inspection import is_image
from manitwin.pipeline.item import Item


def chosen_generator(config: BuildConfig, annotator: Annotator) -> Generator:
    """Return the generator of a build; a built-in generator with templates is guided by an annotator that can fill them in."""
    generator: Generator = create("generator", config.generator, config)
    reader = getattr(annotator, "template_reader", None)
    if reader is None or not hasattr(generator, "guided_by"):
        return generator
    guided: Generator = generator.guided_by(reader)
    return guided


def make_input_check(config: BuildConfig) -> Callable[[Item], str | None]:
    """Return a function that states why the chosen generator cannot process an item; None if it can.

    The generator is created for the first item, and errors in its configuration are raised then.
    """

    @cache
    def asked_with() -> frozenset[Asked]:
        return _accepted_inputs(create("generator", config.generator, config))

    def why(item: Item) -> str | None:
        if (contradiction := _two_things(item)) is not None:
            return contradiction
        asked, called, other = "text", f"text ({item.text!r})", "a photo"
        if item.file is not None:
            if "image" in asked_with() or not is_image(Path(item.file)):
                return None
            asked, called, other = "image", f"a photo ({Path(item.file).name})", "a text"
        if asked in asked_with():
            return _without_template(config, item.text) if item.text else None
        able = ", ".join(_generators_accepting(asked))
        return (
            f"the generator {config.generator!r} cannot make a mesh from {called}; choose one that can with"
            f" --generator ({able}), or give {other} or a mesh"
        )

    return why


def _two_things(item: Item) -> str | None:
    """Return an error if an item's text and name denote different known objects; otherwise None."""
    by_text, by_name = (find_prior(said) if said else None for said in (item.text, item.name))
    if by_text is None or by_name is None:
        return None
    if by_text.shape.split()[0] == by_name.shape.split()[0]:  # a mug may be called a cup
        return None
    if by_text.category in (by_name.category, by_name.kin_of) or by_name.category == by_text.kin_of:
        return None
    said = f"the text says {by_text.category!r} ({item.text!r}) and the name {by_name.category!r}"
    return f"{said}; leave out the name, or make both the same"


def _without_template(config: BuildConfig, text: str) -> str | None:
    """Return why a generator restricted to templates cannot process a text, and which generators can; otherwise None."""
    generator = chosen_generator(config, create("annotator", config.annotator, config))
    reason = generator.why_not(text) if hasattr(generator, "why_not") else None
    if reason is None:
        return None
    able = [name for name in _generators_accepting("text") if name != generator.name]
    return f"{reason}; --generator {', '.join(able)} can make other objects from a text"


def _accepted_inputs(generator: Any) -> frozenset[Asked]:
    return getattr(generator, "asked_with", IMAGE_OR_TEXT)


def _generators_accepting(asked: str) -> list[str]:
    """Return the names of the generators that accept a text, or an image."""
    found = []
    for name in sorted(backends()["generator"]):
        with suppress(Unavailable):  # a package that is not completely installed cannot be chosen
            found += [name] if asked in _accepted_inputs(factory("generator", name)) else []
    return found
