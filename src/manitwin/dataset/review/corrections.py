"""Selection of corrections to apply: those that no annotator contradicts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from manitwin.dataset.review.store import Stored
from manitwin.dataset.review.verdicts import DIMENSIONS, Dimension
from manitwin.models.annotators.prior_names import normalise_name
from manitwin.pipeline.human_corrections import HUMAN


@dataclass(frozen=True)
class Correction:
    """A corrected value of one twin. ``source`` is human:<annotator>, for several annotators ``human:ada+ben``."""

    twin_id: str
    dimension: Dimension
    name: str
    value: Any
    source: str


@dataclass(frozen=True)
class Conflict:
    """A correction that is not applied because annotators disagree: the statement of each, 'yes' for the current value."""

    twin_id: str
    dimension: Dimension
    name: str
    said: dict[str, Any]


def resolve_corrections(reviews: Iterable[Stored]) -> tuple[list[Correction], list[Conflict]]:
    """Return the corrections on which all annotators of a twin agree, and the conflicts.

    ``reviews`` has at most one review per annotator and twin. A correction is contradicted by a different value and by a yes in
    its dimension; an "unsure", or a "no" without a value, contradicts nothing. Categories are compared by their normalized names
    in the priors, numbers including their intervals.
    """
    by_twin: dict[str, list[Stored]] = {}
    for each in reviews:
        by_twin.setdefault(each.review.twin_id, []).append(each)
    agreed, conflicts = [], []
    for twin_id, of in sorted(by_twin.items()):
        for dimension, name, said in _proposals(of):
            if len({_key(value) for value in said.values()}) == 1:
                names = "+".join(sorted(said))
                agreed.append(Correction(twin_id, dimension, name, next(iter(said.values())), f"{HUMAN}{names}"))
            else:
                conflicts.append(Conflict(twin_id, dimension, name, dict(sorted(said.items()))))
    return agreed, conflicts


def _proposals(reviews: list[Stored]) -> Iterator[tuple[Dimension, str, dict[str, Any]]]:
    """Yield each corrected value with the statement of each annotator on it: a value, or 'yes'."""
    for dimension in DIMENSIONS:
        by_name: dict[str, dict[str, Any]] = {}
        for review in (each.review for each in reviews):
            for name, value in review.corrections.of(dimension).items():
                by_name.setdefault(name, {})[review.annotator] = value
        content = [each.review.annotator for each in reviews if each.review.answers.get(dimension) == "yes"]
        for name, said in sorted(by_name.items()):
            yield dimension, name, said | dict.fromkeys(content, "yes")


def _key(value: Any) -> object:
    if isinstance(value, str):
        return normalise_name(value)
    return tuple(sorted(value.items())) if isinstance(value, dict) else value
