"""Facts about an input known before it is processed: category, group and typical size."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple

from manitwin.models.annotators.prior_names import named

UNKNOWN = "unknown"
GROUPS = ("kitchen", "tools", "electronics", "personal", "office", "household")
"""The paper's six groups of categories (section 4)."""
GROUP_OF_DOMAIN = {
    "kitchen": "kitchen",
    "tableware": "kitchen",
    "containers": "kitchen",
    "tools": "tools",
    "electronics": "electronics",
    "personal": "personal",
    "office": "office",
    "household": "household",
    "furniture": "household",
    "toys": "household",
    "food": "household",
}
"""Group of each domain of the priors, as in the paper (section 4): bottles are kitchen, toys and food household. Furniture, which
the paper does not have, is household too.
"""
SIZE_BANDS_M = (0.02, 0.05, 0.10, 0.20, 0.37)
"""Edges of the size bands in metres. The first and the last are the smallest and largest object of the paper (table 3)."""
_COUNTING = re.compile(r"[\d_\-.]+")


class Facts(NamedTuple):
    """Category of the priors (``unknown`` if none matches), its group, and the longest axis in metres with its source."""

    category: str
    group: str
    size_m: float | None
    size_source: str | None


def infer_facts(name: str | None, size_m: float | None) -> Facts:
    """Return the facts that a name implies. The size is ``size_m`` (longest axis) if given, else the typical size of the prior.

    A name that matches no prior leaves category, group and size unknown.
    """
    known = _facts_from_name(name or "")
    return known if size_m is None else known._replace(size_m=size_m, size_source="given")


@lru_cache(maxsize=8192)
def _facts_from_name(name: str) -> Facts:
    prior = named(name) if name else None
    if prior is None or prior.category == UNKNOWN:
        return Facts(UNKNOWN, UNKNOWN, None, None)
    group = GROUP_OF_DOMAIN.get(prior.domain, UNKNOWN)
    return Facts(prior.category, group, prior.longest_axis_m.typical, prior.source)


def name_of_file(stem: str, folder: str) -> str | None:
    """Return the words of a file's name, else of its folder's name, that match a category: ``claw_hammer-02`` is a
    claw hammer.
    """
    words = (" ".join(_COUNTING.sub(" ", text).split()) for text in (stem, folder))
    return next((each for each in words if each and _facts_from_name(each).category != UNKNOWN), None)


def size_band_of(size_m: float | None) -> str:
    """Return the size band of a longest axis in metres as text in centimetres; ``unknown`` for None."""
    if size_m is None:
        return UNKNOWN
    edges = [f"{edge * 100:g}" for edge in SIZE_BANDS_M]
    if size_m < SIZE_BANDS_M[0]:
        return f"below {edges[0]} cm"
    for low, high, edge in zip(edges, edges[1:], SIZE_BANDS_M[1:], strict=False):
        if size_m <= edge:
            return f"{low} to {high} cm"
    return f"above {edges[-1]} cm"


BANDS = (*(size_band_of(size) for size in (0.01, *SIZE_BANDS_M[1:], 1.0)), UNKNOWN)
"""All bands, smallest first."""
