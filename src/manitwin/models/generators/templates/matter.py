"""Whether a word for a material says what a thing is of, and of what such things usually are."""

from __future__ import annotations

from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_materials
from manitwin.models.generators.templates.looks import MATERIALS, Look, material_of

NO_MATTER_BEFORE = frozenset(
    {
        "coated",
        "plated",
        "lined",
        "covered",
        "look",
        "effect",
        "style",
        "like",
        "free",
        "glue",
        "polish",
        "stain",
        "paint",
    }
    | {"cleaner", "cutter", "opener", "softener", "conditioner", "protector", "remover", "varnish", "oil", "filler"}
    | {"wash", "care", "wool", "punch", "man", "scrap", "pattern", "patterned", "print", "printed", "recycling"}
)
"""Behind the name of a material: the thing is not of it."""
_NEVER_BEFORE_A_NAME = frozenset({"soap", "wax", "bristle", "electronics"})
_WORKED_ON = {
    "tools": frozenset(
        {"wood", "paper", "glass", "leather", "fabric", "cloth", "stone", "metal", "foam", "cork", "tin"}
    ),
    "office": frozenset({"paper"}),
}
"""Nouns before the name of a tool that say what it is for, by the priors' domain: a wood saw and a paper punch."""
_SOFT = frozenset({"textile", "wax"})


def is_matter(word: str, look: Look, of: Prior) -> bool:
    """Tell whether a word before a thing's name says what it is of: the steel of a steel mug, not the wood of a wood saw.

    What such things are of anyway it always says; soap, wax and soft matter never of others, nor what a tool works on.
    """
    usual = surfaces_of(of)
    if look.surface in usual or is_food(of):
        return True
    if word in _NEVER_BEFORE_A_NAME or word in _WORKED_ON.get(of.domain, ()):
        return False
    return look.surface not in _SOFT or bool(usual & {"textile", "leather"})


def is_food(prior: Prior) -> bool:
    """Tell whether a prior is of food, whose imitations are of any matter."""
    return prior.surface == "food skin"


def is_composite(prior: Prior) -> bool:
    """Tell whether things of a prior have parts of unlike matter, and are not of one of several."""
    return not is_food(prior) and not {"and", "with"}.isdisjoint(prior.material.split())


def looks_in(material: str) -> list[Look]:
    """Return the looks that the words of a prior's material name, metal as each of its kinds."""
    words = material.replace(",", " ").replace("-", " ").split()
    looks, at = list[Look](), 0
    while at < len(words):
        pair = material_of(" ".join(words[at : at + 2])) if at + 1 < len(words) else None
        look = pair or material_of(words[at])
        if words[at] == "metal":
            looks += [MATERIALS["steel"], MATERIALS["aluminium"]]
        elif look is not None:
            looks.append(look)
        at += 2 if pair is not None else 1
    return looks


def surfaces_of(prior: Prior) -> frozenset[str]:
    """Return the materials of the priors that the words of a prior's material name."""
    words = prior.material.replace(",", " ").split()
    return frozenset(
        {look.surface for look in looks_in(prior.material)} | {word for word in words if word in load_materials()}
    )
