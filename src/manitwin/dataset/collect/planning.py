"""Plan a balanced set of inputs over groups, size bands and categories, with prompts for the missing ones."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from manitwin.dataset.collect.facts import BANDS, GROUPS, UNKNOWN, infer_facts, size_band_of
from manitwin.dataset.collect.prompt_templates import SENTENCES, format_prompt
from manitwin.dataset.collect.store import Row
from manitwin.models.annotators.priors import load_priors

INSIDE = BANDS[1:-2]
"""The bands from 2 to 37 cm, without those below, above and unknown."""


@dataclass(frozen=True)
class Prompt:
    """A prompt for a generator; ``category`` is the category of the object it describes."""

    text: str
    category: str


@dataclass(frozen=True)
class CollectPlan:
    """The planned inputs: ``chosen`` rows, ``prompts`` for the rest, and per group the number ``wanted`` and the number
    ``there``.

    ``left_out`` counts the rows that were not eligible, by cause.
    """

    items: int
    chosen: tuple[Row, ...]
    prompts: tuple[Prompt, ...]
    wanted: dict[str, int]
    there: dict[str, int]
    left_out: dict[str, int] = field(default_factory=dict)


def plan_inputs(
    rows: Iterable[Row], items: int, *, seed: int = 0, licenses: Sequence[str] | None = None
) -> CollectPlan:
    """Choose ``items`` inputs from the eligible rows, an equal share for each of the six groups.

    Rows are taken in round-robin order over the size bands of a group, and within a band over its categories. Prompts fill the
    shortfall of a group, starting with the categories that have the fewest inputs. URLs, rows of an unknown licence (or of none
    in ``licenses``), of an unknown category, or of a size outside 2 to 37 cm are left out and counted. Equal rows, number and
    seed give the same plan.
    """
    by_cell: dict[str, dict[str, dict[str, list[Row]]]] = {
        group: defaultdict(lambda: defaultdict(list)) for group in GROUPS
    }
    left_out: dict[str, int] = defaultdict(int)
    for row in rows:
        why = _exclusion_reason(row, licenses)
        if why is not None:
            left_out[why] += 1
        else:
            by_cell[row.grp][row.size_band][row.category].append(row)
    wanted = shares(items, len(GROUPS))
    chosen: list[Row] = []
    prompts: list[Prompt] = []
    there = {}
    for group, count in zip(GROUPS, wanted, strict=True):
        of_group = _round_robin(by_cell[group], count, seed)
        there[group] = len(of_group)
        chosen += of_group
        prompts += _prompts(group, count - len(of_group), of_group, seed)
    return CollectPlan(
        items,
        tuple(chosen),
        tuple(prompts),
        dict(zip(GROUPS, wanted, strict=True)),
        there,
        dict(sorted(left_out.items())),
    )


def shares(items: int, parts: int) -> list[int]:
    """Split ``items`` into ``parts`` integers that differ by at most one, larger ones first."""
    return [items // parts + (number < items % parts) for number in range(parts)]


def _exclusion_reason(row: Row, licenses: Sequence[str] | None) -> str | None:
    if row.kind == "url":
        return "an address, which nothing is fetched from"
    if licenses is None and row.licence == UNKNOWN:
        return "unknown licence"
    if licenses is not None and row.licence.lower() not in {
        each.strip().lower() for each in licenses
    }:  # SPDX 2.3, annex D.2: identifiers are matched case-insensitively
        return "licence not among those allowed"
    if row.grp == UNKNOWN:
        return "unknown category"
    return None if row.size_band in INSIDE else "size outside of 2 to 37 cm"


def _round_robin(bands: Mapping[str, Mapping[str, list[Row]]], count: int, seed: int) -> list[Row]:
    """Return up to ``count`` rows, alternating over the bands and, within a band, over the categories."""
    queues = []
    for band in INSIDE:
        categories = bands.get(band, {})
        shuffled = [
            sorted(categories[name], key=lambda row: _random_key(seed, row.sha256 or row.place))
            for name in sorted(categories)
        ]
        turns = max(map(len, shuffled), default=0)
        queues.append([queue[turn] for turn in range(turns) for queue in shuffled if turn < len(queue)])
    longest = max(map(len, queues), default=0)
    served = [queue[turn] for turn in range(longest) for queue in queues if turn < len(queue)]
    return served[:count]


def _prompts(group: str, count: int, there: Sequence[Row], seed: int) -> list[Prompt]:
    """Return ``count`` prompts for categories of a group, those with the fewest inputs first."""
    if count <= 0:
        return []
    have: dict[str, int] = defaultdict(int)
    for row in there:
        have[row.category] += 1
    priors = [
        prior
        for name, prior in sorted(load_priors().items())
        if name != UNKNOWN and (said := infer_facts(name, None)).group == group and size_band_of(said.size_m) in INSIDE
    ]
    if not priors:
        return []
    asked: dict[str, int] = defaultdict(int)
    rng = np.random.default_rng([seed, GROUPS.index(group)])
    order = rng.permutation(len(priors))
    made: list[Prompt] = []
    while len(made) < count:
        least = min(have[prior.category] + asked[prior.category] for prior in priors)
        for index in order:
            prior = priors[index]
            if len(made) == count:
                break
            if have[prior.category] + asked[prior.category] == least:
                number = asked[prior.category]
                asked[prior.category] += 1
                made.append(Prompt(format_prompt(prior, number % len(SENTENCES), rng), prior.category))
    return made


def _random_key(seed: int, key: str) -> bytes:
    return hashlib.sha256(f"{seed}\0{key}".encode()).digest()
