"""Names of the parts of a surface: from the labels of points chosen on them, else from the prior of the object."""

from __future__ import annotations

import re
from collections.abc import Iterable

from manitwin.geometry.parts.feature_names import Feature
from manitwin.models.annotators.prior_records import Prior

_FEATURES: dict[str, tuple[Feature, ...]] = {
    "handle": ("handle", "handle_end"),
    "head": ("head", "edge", "tip"),
    "body": ("side", "center"),
    "inside": ("inside",),
    "rim": ("rim",),
    "base": ("base",),
    "top": ("top",),
    "cap": ("top", "nozzle"),
    "spout": ("spout",),
    "stem": ("neck",),
    "foot": ("base",),
    "grip": ("grip",),
    "housing": ("housing",),
    "band": ("apex",),
    "cup": ("arch_end",),
    "side": ("side", "end"),
    "front": ("front",),
    "back": ("back",),
    "shaft": ("middle", "center", "handle", "side", "neck"),
    "tip": ("tip", "head", "edge", "top"),
    "end": ("handle_end", "handle", "base"),
}
"""For each part role, the features whose label in a prior names the whole part, the best first."""
_WORDS: dict[str, frozenset[str]] = {
    "handle": frozenset(["handle", "handles", "grip", "grips", "shaft", "bow"]),
    "head": frozenset(
        ["head", "blade", "blades", "shaft", "bowl", "tines", "jaws", "bristles", "beater", "wires", "worm"]
    ),
    "body": frozenset(["body", "barrel", "wall", "side", "bottle"]),
    "cap": frozenset(["cap", "lid", "nozzle", "pump", "sprayer", "stopper", "top"]),
    "spout": frozenset({"spout"}),
    "stem": frozenset({"stem"}),
    "neck": frozenset(["neck", "shaft", "shank", "stem"]),
    "foot": frozenset(["foot", "base"]),
    "bowl": frozenset(["bowl", "cup"]),
    "inside": frozenset(["inside", "interior", "cavity", "hollow", "floor", "surface"]),
    "rim": frozenset(["rim", "lip", "brim", "edge"]),
    "base": frozenset(["base", "bottom", "underside", "foot", "sole"]),
    "top": frozenset(["top", "lid"]),
    "grip": frozenset(["grip", "handle"]),
    "housing": frozenset(["housing", "body", "barrel"]),
    "band": frozenset(["band", "headband"]),
    "cup": frozenset(["cup", "cups"]),
    "side": frozenset(["side", "sides", "edge", "edges"]),
    "front": frozenset(["front", "cover", "surface", "wiping", "screen", "display"]),
    "back": frozenset(["back"]),
    "shaft": frozenset(
        ["shaft", "body", "barrel", "joint", "roller", "handle", "bulb", "cover", "tube", "bow", "blade"]
    ),
    "tip": frozenset(["tip", "cap", "jaw", "jaws", "stem", "head", "blade", "base", "end", "nozzle", "handle"]),
    "end": frozenset(["end", "handle", "handles", "grip", "seam", "bow", "base"]),
}
"""For each part role, words that a label contains if it names the whole part instead of a place on it."""


def roles_in_label(label: str, roles: Iterable[str]) -> list[str]:
    """Return which of ``roles`` a label names ('blade and neck': head, neck); a word that fits several roles names none."""
    known, named = list(roles), []
    for word in re.findall(r"[a-z]+", label.lower()):
        meant = [word] if word in known else [role for role in known if word in _WORDS[role]]
        named += meant if len(meant) == 1 else []
    return list(dict.fromkeys(named))


def part_name(role: str, prior: Prior, labels_there: Iterable[str], shown: Iterable[str] = ()) -> str:
    """Return the name of a part with a role; ``labels_there`` are the labels of the points on it, in order.

    The prior's label is used if a point on the part has it, or if no label there names the whole part. ``shown`` are the
    roles found on the object: a shaft includes an end that is not a part of its own, and both ends of a rolling pin are
    handles.
    """
    usual = _usual_part_label(role, prior, set(shown))
    said = [" ".join(label.lower().split()) for label in labels_there]
    if usual in said:
        return usual
    return next((label for label in said if _WORDS[role] & set(label.split())), usual)


def _usual_part_label(role: str, prior: Prior, shown: set[str]) -> str:
    """Return the prior's label of a part, or its role if the prior has no label of the whole part."""
    by_feature = {part.feature: part.label for part in reversed(prior.functional)}
    features = _FEATURES.get(role, ())
    if role == "shaft":
        features += (() if "end" in shown else _FEATURES["end"]) + (() if "tip" in shown else _FEATURES["tip"])
    elif role == "tip" and "end" in shown:
        features += ("handle_end",)
    labels = [by_feature[feature] for feature in features if feature in by_feature]
    if role == "end" and "shaft" in shown:
        labels = [label for label in labels if label != _usual_part_label("shaft", prior, shown)]
    usual = next(iter(labels), role)
    return usual if _WORDS[role] & set(usual.lower().split()) else role  # e.g. finger rings are a place on the handle
