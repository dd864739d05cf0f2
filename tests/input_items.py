"""The items that a build reads from what a user typed, as a list."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from manitwin.pipeline.item import Item
from manitwin.pipeline.manifest import Notes, iterate_items


def collect_items(
    inputs: Iterable[str | Path],
    texts: Iterable[str] = (),
    *,
    strict: bool = False,
    refusal: Callable[[Item], str | None] = lambda item: None,
    **defaults: str | None,
) -> tuple[list[Item], Notes]:
    """Return the items in order, without repeats, and what is to be said of the inputs."""
    notes = Notes()
    return list(dict.fromkeys(iterate_items(inputs, defaults, notes, texts, strict=strict, refusal=refusal))), notes
