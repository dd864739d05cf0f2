"""A size that a mesh declares and such things do not have: said first where grasps fail, since it explains them."""

from __future__ import annotations

from typing import Any

from manitwin.engine.stage import Draft
from manitwin.models.annotators.prior_names import found_by, word_for
from manitwin.models.annotators.priors import unknown_prior
from manitwin.pipeline.object_state import object_name
from manitwin.pipeline.size_remarks import CHECK_SCALE

FACTORS = {
    1000.0: "metres taken for millimetres", 100.0: "metres taken for centimetres", 10.0: "centimetres taken for millimetres",
    25.4: "inches taken for millimetres", 1 / 1000: "millimetres taken for metres", 1 / 100: "centimetres taken for metres",
    1 / 10: "millimetres taken for centimetres", 1 / 25.4: "millimetres taken for inches",
}  # fmt: skip
"""By how much the true size is larger than the declared one, and what happened."""

_BEYOND = 1.25
"""Times the largest such things: what is that little larger (or smaller) is a large one, and no unit explains it."""


def suspicious_size_words(draft: Draft[Any]) -> str | None:
    """Say that a declared size is not that of such things, and which unit would make it so; None where it is theirs.

    Nothing is said where the size was estimated (``guesses.unsaid_size_words``).
    """
    if draft.fields.get("size") is not None or not draft.fields.get("geometry", {}).get("metric"):
        return None
    physical = draft.fields.get("physical")
    if physical is None:
        return None
    longest_m, found = float(max(physical["extents_m"])), found_by(object_name(draft))
    prior = None if found is None else found[0]
    usual = (prior or unknown_prior()).longest_axis_m
    if usual.low / _BEYOND <= longest_m <= _BEYOND * usual.high:
        return None
    such = "things of a hand's size have" if found is None else f"nearly every {word_for(*found)} has"
    mixed = next(
        (f" ({said}?)" for factor, said in FACTORS.items() if usual.low <= factor * longest_m <= usual.high), ""
    )
    return f"it is {_mm(longest_m)} long, but {such} {_mm(usual.low)} to {_mm(usual.high)}{mixed}: {CHECK_SCALE}"


def _mm(length_m: float) -> str:
    return f"{1000 * length_m:.3g} mm" if length_m < 1 else f"{length_m:.3g} m"
