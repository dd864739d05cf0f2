"""Several things of one name that touch or hide one another are one piece, of an outline that one such thing has from no side."""

from __future__ import annotations

from manitwin.errors import Rejected
from manitwin.models.annotators.prior_names import found_by, normalised, singulars
from manitwin.models.generators.templates.fitting.fit import Fitted

GROWN = frozenset({
    "apple", "apricot", "avocado", "banana", "beetroot", "bell pepper", "carrot", "corn", "cucumber", "eggplant",
    "fig", "garlic", "grapefruit", "kiwi", "lemon", "lime", "mango", "mushroom", "onion", "orange", "papaya",
    "peach", "pear", "plum", "pomegranate", "potato", "pumpkin", "radish", "strawberry", "sweet potato", "tomato",
    "turnip",
})  # fmt: skip
"""Templates of what grows: one is much like another, so that the outline of each of them is near the template's."""
FAR_OUTLINE = 0.017
"""Of the thing's length, in the mean, from which on an outline is not that of one such thing. Of 61 outlines of one, of 16 kinds,
of random measures and bent, none is farther from its template's; of 58 of two to five that hide one another in part 54 are."""


def reject_heap(fitted: Fitted, name: str, category: str) -> None:
    """Raise Rejected (``several_objects``) where the nearest that one thing of a ``name`` comes to an outline is far from it.

    That is where the name, whose template's ``category`` is given, is of what grows, or in the plural: other things of a name
    have other shapes as well.
    """
    residual = fitted.residual
    plural = is_plural(name)
    if residual.outline <= FAR_OUTLINE or not (plural or category in GROWN):
        return
    remedy = (
        f"if {name!r} is one, name it in the singular; of several crop the photo to one of them"
        if plural
        else "crop the photo to one of them"
    )
    raise Rejected(
        "several_objects",
        f"no {category} has this outline ({residual.outline:.3f} of its length apart at the best fit, at most"
        f" {FAR_OUTLINE}), but several objects that touch or hide one another may have it, or a piece of one;"
        f" {remedy}, or check the cut-out",
        "generate",
    )


def is_plural(name: str) -> bool:
    """Tell whether a name is the plural of what the priors have in the singular: carrots, and not scissors."""
    found = found_by(name)
    if found is None:
        return False
    one, words = found[1].split()[-1], normalised(name).split()
    return one not in words and any(one in singulars(word) for word in words)
