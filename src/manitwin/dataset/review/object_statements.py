"""Name and longest side of an object as stated while its outline is drawn: parsing, validation and storage."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from manitwin.config import GateConfig
from manitwin.engine.amendments import Amendments
from manitwin.errors import UsageError
from manitwin.formats.printable import printable_line
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.priors import load_priors
from manitwin.pipeline.guesses import unknown_name_words
from manitwin.pipeline.human_corrections import CATEGORY, NAME, NAME_STAGES, SIZE, SIZE_STAGE, STAGES, CorrectedName
from manitwin.pipeline.item import Item
from manitwin.pipeline.manifest_item import unusable
from manitwin.pipeline.stated_size import COLUMN, stated_size_m
from manitwin.twin.record_values import Estimate

_DIGITS = 6
"""Significant digits of a typed length; lengths that agree in them are equal."""
_SHOWN_CHARACTERS = 60


@dataclass(frozen=True)
class ObjectStatement:
    """An object's name and its longest side (cm) as typed; '' if not stated."""

    name: str = ""
    longest_side_cm: str = ""


def original_statement(item: Item) -> ObjectStatement:
    """Return the statements that the input was given with."""
    return ObjectStatement(item.name or "", "" if item.longest_side_m is None else _centimetres(item.longest_side_m))


def current_statement(item: Item, amendments: Amendments) -> ObjectStatement:
    """Return the current statements on an input; later amendments take precedence over the input's own."""
    given = original_statement(item)
    name = _first_amendment(amendments, STAGES[CATEGORY], CATEGORY)
    if name is None:
        said = _first_amendment(amendments, NAME_STAGES, NAME)
        name = given.name if said is None else CorrectedName.model_validate(said).value
    size = _first_amendment(amendments, (*STAGES[SIZE], SIZE_STAGE), SIZE)
    side_cm = given.longest_side_cm if size is None else _centimetres(Estimate.model_validate(size).value)
    return ObjectStatement(str(name), side_cm)


def read_name(typed: object) -> str:
    """Return a typed name, '' if empty; raises UsageError for a name that a manifest would not accept."""
    if not isinstance(typed, str):
        raise UsageError("a name is a text; send an empty text for unknown")
    name = typed.strip()
    why = unusable("name", name)
    if why is not None:
        raise UsageError(f"not kept: the name: {why}")
    return name


def read_side_cm(typed: object, gate: GateConfig) -> str:
    """Return a typed longest side (cm), '' if empty; raises UsageError for a length outside the limits of ``gate``."""
    if not isinstance(typed, str):
        raise UsageError("a longest side is a text; send an empty text for unknown")
    number = typed.strip().replace(",", ".")
    if not number:
        return ""
    try:
        length_m = float(number) / 100
    except ValueError:
        length_m = math.nan
    if not gate.min_longest_side_m <= length_m <= gate.max_longest_side_m:
        shown = printable_line(typed.strip(), max_characters=_SHOWN_CHARACTERS)
        least, most = _centimetres(gate.min_longest_side_m), _centimetres(gate.max_longest_side_m)
        raise UsageError(
            f"not kept: the longest side is {shown!r}; give centimetres from {least} to {most}, such as 12"
        )
    return _centimetres(length_m)


def with_statement(amendments: Amendments, item: Item, words: ObjectStatement, source: str) -> Amendments:
    """Return an input's amendments with statements by ``source``; unchanged statements stay as they are.

    An empty field, or the value that the input was given with, removes the amendment. Raises UsageError for a length if a unit
    was stated, as for a manifest row.
    """
    after: dict[str, dict[str, Any]] = {stage: dict(said) for stage, said in amendments.items()}
    before, given = current_statement(item, amendments), original_statement(item)
    if words.name != before.name:
        _remove_amendment(after, STAGES[CATEGORY], CATEGORY)
        _remove_amendment(after, NAME_STAGES, NAME)
        if words.name not in ("", given.name):
            for stage in NAME_STAGES:
                after.setdefault(stage, {})[NAME] = CorrectedName(value=words.name, source=source).model_dump()
    if words.longest_side_cm != before.longest_side_cm:
        _remove_amendment(after, (*STAGES[SIZE], SIZE_STAGE), SIZE)
        if words.longest_side_cm not in ("", given.longest_side_cm):
            typed_m = float(words.longest_side_cm) / 100
            length_m = stated_size_m({COLUMN: typed_m, "units": item.units}, "not kept")
            said = Estimate.model_validate({"value": length_m, "low": length_m, "high": length_m, "source": source})
            after.setdefault(SIZE_STAGE, {})[SIZE] = said.model_dump()
    return {stage: said for stage, said in after.items() if said}


def known_names() -> list[str]:
    """Return the categories of the priors in alphabetical order."""
    return sorted(prior.category for prior in load_priors().values() if prior.category != "unknown")


def name_remark(name: str) -> str:
    """Return a remark on a name: the usual size of such objects, or the nearest known names; '' for an empty name."""
    if not name:
        return ""
    prior = find_prior(name)
    if prior is None:
        return unknown_name_words(name, "name the kind of object, in English")
    low, high = (_centimetres(length_m) for length_m in (prior.longest_axis_m.low, prior.longest_axis_m.high))
    return f"known as: {prior.category}, {low} to {high} cm long as a rule"


def _first_amendment(amendments: Amendments, stages: Iterable[str], key: str) -> Any:
    return next((amendments[stage][key] for stage in stages if key in amendments.get(stage, {})), None)


def _remove_amendment(amendments: Amendments, stages: Iterable[str], key: str) -> None:
    for stage in stages:
        amendments.get(stage, {}).pop(key, None)


def _centimetres(length_m: float) -> str:
    return f"{100 * length_m:.{_DIGITS}g}"
