"""Referring expressions: words that identify one object of a picture."""

from __future__ import annotations

import random
from collections.abc import Collection

from manitwin.models.annotators.descriptions import article
from manitwin.models.annotators.surface_color import are_similar_colors
from manitwin.scenes.vqa.nouns import noun_counter, noun_of, nouns_of, words_of
from manitwin.scenes.vqa.posed_objects import ObjectInPicture, PosedObject, View

MARGIN_PX = 40
"""Least distance of the outermost object from the next (px of a picture 512 wide)."""
CONTAINERS = ("mug", "cup", "bowl", "bottle", "jar", "can")
"""The nouns that questions about containers name."""
OTHER_VESSELS = (
    "box", "container", "pan", "pot", "vase", "shaker", "plate", "tray", "basket", "bucket", "kettle", "jug", "pitcher",
    "glass", "carton", "tin", "tube", "bag", "case", "shoe", "bin", "crate", "dispenser", "canister", "holder", "teapot",
)  # fmt: skip
"""Nouns that may be called containers: in views with one of them, containers are not asked about."""
_GENERAL = {"container": (*CONTAINERS, *OTHER_VESSELS)}
"""Nouns that also apply to objects with other nouns."""

REGION_MARGIN = 0.03
"""Least distance of a point from the border between two regions (share of the picture)."""


def find_references(view: View, rng: random.Random) -> dict[str, str]:
    """Return a reference such as ``the yellow bottle`` by object name, for each clear object that has a unique one.

    The rivals of an object are the visible objects that its noun may also denote. Without rivals, its category is used, at
    random with its colour; with rivals, its colour if all rivals have others, else that it is the outermost of its kind in the
    picture.
    """
    found = {}
    shown = [each for each in view.seen if not each.is_hidden]
    for seen in view.clear_objects:
        rivals = [each for each in shown if each is not seen and _may_share_noun(each, seen.thing)]
        words = _words(seen, rivals, rng, MARGIN_PX * view.camera.width_px / 512)
        if words is not None:
            found[seen.thing.name] = words
    return found


def _may_share_noun(other: ObjectInPicture, thing: PosedObject) -> bool:
    """Return whether the noun of an object may denote another one too: an allen key and a door key may both be "the key"."""
    noun = thing.head
    names_it = noun == thing.category == other.thing.category.split()[-1]
    return names_it or noun in nouns_of(other.thing.category) or other.thing.head in _GENERAL.get(noun, ())


def _words(seen: ObjectInPicture, rivals: list[ObjectInPicture], rng: random.Random, margin_px: float) -> str | None:
    thing = seen.thing
    with_color = rng.random() < 0.5
    if not rivals:
        return f"the {one_of(thing.category, seen.color if with_color else None)}"
    colors = [each.color for each in rivals]
    if seen.color and all(color and not are_similar_colors(color, seen.color) for color in colors):
        return f"the {one_of(thing.category, seen.color)}"
    if not all(each.is_clear and each.thing.head == thing.head for each in rivals):
        return None
    columns = [each.column for each in rivals]
    if seen.column < min(columns) - margin_px:
        return f"the {one_of(thing.head)} that is leftmost in the picture"
    if seen.column > max(columns) + margin_px:
        return f"the {one_of(thing.head)} that is rightmost in the picture"
    return None


def region(x: float, y: float) -> str | None:
    """Return the words for the ninth of the picture that contains a point; ``x`` and ``y`` in shares of its size.

    None for a point within ``REGION_MARGIN`` of a border, whose region is ambiguous.
    """
    if any(abs(place - border) < REGION_MARGIN for place in (x, y) for border in (1 / 3, 2 / 3)):
        return None
    row = "top" if y < 1 / 3 else "bottom" if y > 2 / 3 else "middle"
    column = "left" if x < 1 / 3 else "right" if x > 2 / 3 else "center"
    return "center" if (row, column) == ("middle", "center") else f"{row} {column}"


def one_of(noun: str, color: str | None = None) -> str:
    """Return the words for one object: ``black pair of scissors``, ``yellow bottle``, ``bar of soap``."""
    counter = noun_counter(noun)
    thing = noun if counter is None else f"{counter} {noun}"
    return f"{color} {thing}" if color else thing


def a_or_an(noun: str) -> str:
    """Return a noun with its indefinite article."""
    return f"{article(noun)} {noun}"


def could_be_asked_for(category: str, present: Collection[str]) -> bool:
    """Return whether a reader may take one of the ``present`` categories for a category."""
    vessels = {noun_of(each) for each in present} & {*CONTAINERS, *OTHER_VESSELS}
    names = frozenset().union(*(nouns_of(each) | words_of(each) for each in present))
    return bool((nouns_of(category) | words_of(category)) & names) or (
        noun_of(category) in ("container", "box") and bool(vessels)
    )


def is_container(category: str) -> bool | None:
    """Return whether a category is one of ``CONTAINERS``; None for one that some readers may call a container."""
    noun = noun_of(category)
    if noun in CONTAINERS:
        return True
    called = words_of(category) | nouns_of(category)
    return None if called & {*CONTAINERS, *OTHER_VESSELS} else False
