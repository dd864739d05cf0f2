"""Declared sizes that are unusual for the object: reported first if grasps fail, and a failed check if they hold."""

from __future__ import annotations

from typing import Any

from manitwin.engine.stage import Draft
from manitwin.models.annotators.prior_names import found_by, object_noun
from manitwin.models.annotators.priors import unknown_prior
from manitwin.pipeline.object_state import object_name
from manitwin.pipeline.size_remarks import CHECK_SCALE
from manitwin.twin.record import TwinRecord
from manitwin.twin.record_values import Check

FACTORS = {
    1000.0: "metres taken for millimetres", 100.0: "metres taken for centimetres", 10.0: "centimetres taken for millimetres",
    25.4: "inches taken for millimetres", 1 / 1000: "millimetres taken for metres", 1 / 100: "centimetres taken for metres",
    1 / 10: "millimetres taken for centimetres", 1 / 25.4: "millimetres taken for inches",
}  # fmt: skip
"""The true size relative to the declared one, and the mistake."""

_USUAL_SIZE = "usual_size"
_BEYOND = 1.25
"""Tolerance beyond the usual sizes that no wrong unit would explain."""


def suspicious_size_words(draft: Draft[Any]) -> str | None:
    """Describe that a declared size is unusual, and which unit would be plausible; None if it is usual.

    Estimated sizes are not considered (``guesses.unsaid_size_words``).
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
    such = "things of a hand's size have" if found is None else f"nearly every {object_noun(*found)} has"
    mixed = next(
        (f" ({said}?)" for factor, said in FACTORS.items() if usual.low <= factor * longest_m <= usual.high), ""
    )
    return f"it is {_mm(longest_m)} long, but {such} {_mm(usual.low)} to {_mm(usual.high)}{mixed}: {CHECK_SCALE}"


def usual_size_checks(draft: Draft[Any]) -> list[Check]:
    """Return the failed check of a size that such things do not have; none where it is theirs, or was estimated."""
    words = suspicious_size_words(draft)
    if words is None:
        return []
    return [
        Check(name="usual_size", passed=False, value=float(max(draft.field("physical")["extents_m"])), message=words)
    ]


def unusual_size_hint(record: TwinRecord) -> str | None:
    """Return what to tell of the size of an accepted twin that such things do not have; None of any other."""
    checks = record.quality.checks if record.rejection is None else []
    return next((check.message for check in checks if check.name == _USUAL_SIZE and check.passed is False), None)


def _mm(length_m: float) -> str:
    return f"{1000 * length_m:.3g} mm" if length_m < 1 else f"{length_m:.3g} m"
