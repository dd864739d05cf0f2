"""Decide whether a material word states what an object is made of, and which materials are usual for it."""

from __future__ import annotations

from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_materials
from manitwin.models.generators.templates.looks import MATERIALS, Look, material_of

NON_MATERIAL_HEADS = frozenset(
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
"""Words after a material name that show that the object is not made of it."""
_NON_MATERIAL_WORDS = frozenset({"soap", "wax", "bristle", "electronics"})
_WORKPIECE_MATERIALS = {
    "tools": frozenset(
        {"wood", "paper", "glass", "leather", "fabric", "cloth", "stone", "metal", "foam", "cork", "tin"}
    ),
    "office": frozenset({"paper"}),
}
"""Nouns before a tool's name that state its purpose, by domain of the priors: a wood saw, a paper punch."""
_SOFT = frozenset({"textile", "wax"})


def is_material_of_object(word: str, look: Look, of: Prior) -> bool:
    """Return whether a word before an object's name states its material: steel of a steel mug, but not wood of a wood saw.

    It does for usual materials of the object. It does not for soap, wax and soft materials on other objects, nor for the material
    that a tool works on.
    """
    usual = surfaces_of(of)
    if look.surface in usual or is_food(of):
        return True
    if word in _NON_MATERIAL_WORDS or word in _WORKPIECE_MATERIALS.get(of.domain, ()):
        return False
    return look.surface not in _SOFT or bool(usual & {"textile", "leather"})


def is_food(prior: Prior) -> bool:
    """Return whether a prior is of food, whose imitations may be of any material."""
    return prior.surface == "food skin"


def is_composite(prior: Prior) -> bool:
    """Return whether objects of a prior have parts of different materials, rather than one of several materials."""
    return not is_food(prior) and not {"and", "with"}.isdisjoint(prior.material.split())


def looks_of_materials(material: str) -> list[Look]:
    """Return the looks of the materials in a prior's material text; metal stands for steel and aluminium."""
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
    """Return the surface materials in a prior's material text."""
    words = prior.material.replace(",", " ").split()
    return frozenset(
        {look.surface for look in looks_of_materials(prior.material)}
        | {word for word in words if word in load_materials()}
    )
