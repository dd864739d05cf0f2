"""Which episodes may go out: those whose objects all come from twins under an allowed licence."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from manitwin.apps.trajectories.attempt import Attempt
from manitwin.apps.trajectories.episodes_stage import EPISODES
from manitwin.apps.trajectories.hdf5_file import EpisodeFile
from manitwin.errors import UsageError
from manitwin.publish.licences import UNKNOWN, Allowed
from manitwin.scenes.twin_source import TwinSource


@dataclass(frozen=True)
class TwinInEpisodes:
    """What is to be known of a twin that episodes show: whom to credit, and the numbers of the published episodes."""

    twin_id: str
    revision: str
    category: str
    license: str
    attribution: str | None
    source_sha256: str
    rehearsal: bool
    episodes: tuple[int, ...] = ()


@dataclass(frozen=True)
class Chosen:
    """The numbers of the episodes that go out by their ids, the ids of those ``held_back``, and how many these are by licence.

    ``rehearsals`` are those held back although all licences let them go: a rehearsal server had a part in one of their twins.
    ``twins`` are those of all objects of what goes out, and ``allowed_targets`` the ids of those that were to be moved.
    """

    index_of: dict[str, int]
    held_back: frozenset[str]
    twins: tuple[TwinInEpisodes, ...]
    left_out: dict[str, int]
    allowed_targets: frozenset[str]
    rehearsals: int = 0

    def tells_of(self, attempt: Attempt) -> bool:
        """Tell whether success rates may count an attempt: its object's licence allows it."""
        return not attempt.twin_id or attempt.twin_id in self.allowed_targets

    def publishes(self, attempt: Attempt) -> bool:
        """Tell whether an attempt's row goes out."""
        return self.tells_of(attempt) and attempt.episode_id not in self.held_back


def choose_episodes(
    batches: Iterable[Path],
    attempts: Iterable[Attempt],
    source: TwinSource,
    license_allow: Iterable[str] | None,
    *,
    with_rehearsals: bool = False,
) -> Chosen:
    """Choose among the kept episodes of batches; every object counts, the one that is moved and those that stand around.

    An episode is left out under the licences that keep it here: ``CC-BY-NC-4.0``, or ``CC-BY-NC-4.0 + unknown``. One
    with a twin that a rehearsal server had a part in is left out unless ``with_rehearsals``. Raises
    UsageError where a twin is gone, and where no episode may go out.
    """
    allowed, known = Allowed.of(license_allow), dict[str, TwinInEpisodes]()

    def twin(twin_id: str) -> TwinInEpisodes:
        if twin_id not in known:
            known[twin_id] = _read(source, twin_id)
        return known[twin_id]

    def rehearsed(twin_id: str) -> bool:
        return not with_rehearsals and twin(twin_id).rehearsal

    index_of, held_back, rehearsals = dict[str, int](), set[str](), 0
    seen, left_out = defaultdict[str, list[int]](list), Counter[str]()
    for episode_id, twin_ids in objects_of_episodes(batches):
        forbidden = sorted({name for each in twin_ids if not allowed.has(name := twin(each).license)})
        if forbidden:
            held_back.add(episode_id)
            left_out[" + ".join(forbidden)] += 1
        elif any(map(rehearsed, twin_ids)):
            held_back.add(episode_id)
            rehearsals += 1
        else:
            for each in twin_ids:
                seen[each].append(len(index_of))
            index_of[episode_id] = len(index_of)
    if not index_of and rehearsals:
        raise UsageError(
            f"no episode may go out: {rehearsals:,} show twins of a rehearsal, made by manitwin fake and not by models; build"
            " these with models, or ask for them with --with-rehearsals"
        )
    if not index_of:
        there = ", ".join(f"{name} ({count})" for name, count in sorted(left_out.items())) or "no episode was kept"
        raise UsageError(
            f"no episode may go out; licences that keep them: {there}; name those that may in --license-allow,"
            f" {UNKNOWN!r} too if you know that you may"
        )
    targets = {attempt.twin_id for attempt in attempts if attempt.twin_id}
    allowed_targets = {each for each in targets if allowed.has(twin(each).license) and not rehearsed(each)}
    shown = sorted(set(seen) | allowed_targets)
    return Chosen(
        index_of,
        frozenset(held_back),
        tuple(replace(known[each], episodes=tuple(seen[each])) for each in shown),
        dict(sorted(left_out.items())),
        frozenset(allowed_targets),
        rehearsals,
    )


def objects_of_episodes(batches: Iterable[Path]) -> Iterator[tuple[str, frozenset[str]]]:
    """Yield the id of every kept episode with the ids of the twins in it."""
    for folder in batches:
        with EpisodeFile(folder / EPISODES) as file:
            for number in range(len(file)):
                said = file.said(number)
                yield said["attempt"]["episode_id"], frozenset(thing["twin_id"] for thing in said["objects"])


def _read(source: TwinSource, twin_id: str) -> TwinInEpisodes:
    record: dict[str, Any] = json.loads(source.record_bytes(twin_id))
    return TwinInEpisodes(
        twin_id,
        record["revision"],
        record["language"]["category"],
        record["source"]["license"] or UNKNOWN,
        record["source"]["attribution"],
        record["source"]["sha256"],
        any(stage.get("rehearsal") for stage in record["provenance"]["stages"].values()),
    )
