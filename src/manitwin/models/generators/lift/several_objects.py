"""Detection of several objects of one name that touch or occlude each other, by a silhouette that no single one has."""

from __future__ import annotations

from manitwin.errors import Rejected
from manitwin.models.annotators.prior_names import found_by, normalise_name, singulars
from manitwin.models.generators.templates.fitting.fit import TemplateFit

PRODUCE = frozenset({
    "apple", "apricot", "avocado", "banana", "beetroot", "bell pepper", "carrot", "corn", "cucumber", "eggplant",
    "fig", "garlic", "grapefruit", "kiwi", "lemon", "lime", "mango", "mushroom", "onion", "orange", "papaya",
    "peach", "pear", "plum", "pomegranate", "potato", "pumpkin", "radish", "strawberry", "sweet potato", "tomato",
    "turnip",
})  # fmt: skip
"""Templates of fruit and vegetables, whose shapes vary little, so that the silhouette of one is close to the template's."""
MOST_OUTLINE_DISTANCE = 0.017
"""Maximum mean distance of the outlines, over the object's length, for a single object.

Of 61 outlines of single objects of 16 categories, with random measures and bends, none is farther from its template's. Of 58
outlines of two to five objects that partly occlude each other, 54 are.
"""


def reject_several_objects(fitted: TemplateFit, name: str, category: str) -> None:
    """Raise Rejected (``several_objects``) if the best fit of a single object of this ``name`` is far from the silhouette.

    Only names of fruit and vegetables (by the template's ``category``) and plurals are tested, since other names may have
    other shapes.
    """
    residual = fitted.residual
    plural = is_plural(name)
    if residual.outline <= MOST_OUTLINE_DISTANCE or not (plural or category in PRODUCE):
        return
    remedy = (
        f"if {name!r} is one, name it in the singular; of several crop the photo to one of them"
        if plural
        else "crop the photo to one of them"
    )
    raise Rejected(
        "several_objects",
        f"no {category} has this outline ({residual.outline:.3f} of its length apart at the best fit, at most"
        f" {MOST_OUTLINE_DISTANCE}), but several objects that touch or hide one another may have it, or a piece of one;"
        f" {remedy}, or check the cut-out",
        "generate",
    )


def is_plural(name: str) -> bool:
    """Tell whether a name is the plural of a name in the priors: carrots, but not scissors."""
    found = found_by(name)
    if found is None:
        return False
    one, words = found[1].split()[-1], normalise_name(name).split()
    return one not in words and any(one in singulars(word) for word in words)
