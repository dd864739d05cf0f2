"""Choose the episodes to publish: those whose objects all come from twins under an allowed licence."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from manitwin.dataset.publish.licences import UNKNOWN, Allowed, check_some_go_out
from manitwin.episodes.attempts import Attempt
from manitwin.episodes.batch import read_batch
from manitwin.episodes.episodes_stage import EPISODES
from manitwin.episodes.hdf5_file import EpisodeFile
from manitwin.twin.loaded_twin import TwinSource


@dataclass(frozen=True)
class TwinInEpisodes:
    """A twin that published episodes show: whom to credit, and the numbers of these episodes.

    ``revisions`` are those that it had when the batches were made: what it is today may be another (``--retire`` amends it).
    """

    twin_id: str
    category: str
    license: str
    attribution: str | None
    source_sha256: str
    rehearsal: bool
    revisions: tuple[str, ...] = ()
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

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The twins as rows."""
        return [asdict(twin) for twin in self.twins]

    def tells_of(self, attempt: Attempt) -> bool:
        """Tell whether success rates may count an attempt: its object's licence allows it."""
        return not attempt.twin_id or attempt.twin_id in self.allowed_targets

    def publishes(self, attempt: Attempt) -> bool:
        """Tell whether an attempt's row goes out."""
        return self.tells_of(attempt) and attempt.episode_id not in self.held_back


def choose_episodes(
    batches: Sequence[Path],
    attempts: Iterable[Attempt],
    source: TwinSource,
    license_allow: Iterable[str] | None,
    *,
    with_rehearsals: bool = False,
) -> Chosen:
    """Choose among the kept episodes of batches; every object counts, the one that is moved and those that stand around.

    An episode is left out under the licences that keep it here: ``CC-BY-NC-4.0``, or ``CC-BY-NC-4.0 + unknown``. One
    with a twin that a rehearsal server had a part in is left out unless ``with_rehearsals``. Raises
    UsageError where a twin is gone, and where no episode may go out; EpisodesError for a batch that cannot be read.
    """
    twins = _Twins(source, Allowed.of(license_allow), with_rehearsals)
    index_of, held_back, rehearsals = dict[str, int](), set[str](), 0
    seen, left_out = defaultdict[str, list[int]](list), Counter[str]()
    for episode_id, twin_ids in objects_of_episodes(batches):
        forbidden = twins.forbidding_licences(twin_ids)
        if not forbidden and not any(map(twins.held_as_rehearsal, twin_ids)):
            for each in twin_ids:
                seen[each].append(len(index_of))
            index_of[episode_id] = len(index_of)
            continue
        held_back.add(episode_id)
        if forbidden:
            left_out[" + ".join(forbidden)] += 1
        else:
            rehearsals += 1
    check_some_go_out("kept episode", len(index_of), left_out, rehearsals)
    targets = twins.allowed({attempt.twin_id for attempt in attempts if attempt.twin_id})
    revisions = revisions_of_twins(batches)
    shown = (
        replace(twins[each], revisions=revisions.get(each, ()), episodes=tuple(seen[each]))
        for each in sorted(set(seen) | targets)
    )
    return Chosen(index_of, frozenset(held_back), tuple(shown), dict(sorted(left_out.items())), targets, rehearsals)


class _Twins:
    """The twins of episodes, each read once, and what keeps those from going out that may not."""

    def __init__(self, source: TwinSource, licences: Allowed, with_rehearsals: bool):
        self._source, self._licences, self._with_rehearsals = source, licences, with_rehearsals
        self._known: dict[str, TwinInEpisodes] = {}

    def __getitem__(self, twin_id: str) -> TwinInEpisodes:
        if twin_id not in self._known:
            self._known[twin_id] = _read(self._source, twin_id)
        return self._known[twin_id]

    def forbidding_licences(self, twin_ids: Iterable[str]) -> list[str]:
        return sorted({name for each in twin_ids if not self._licences.has(name := self[each].license)})

    def held_as_rehearsal(self, twin_id: str) -> bool:
        return not self._with_rehearsals and self[twin_id].rehearsal

    def allowed(self, twin_ids: Iterable[str]) -> frozenset[str]:
        return frozenset(
            each for each in twin_ids if not self.forbidding_licences([each]) and not self.held_as_rehearsal(each)
        )


def revisions_of_twins(batches: Iterable[Path]) -> dict[str, tuple[str, ...]]:
    """Return the revisions, sorted, that each twin had in batches: one that was amended between two of them had several."""
    found = defaultdict[str, set[str]](set)
    for folder in batches:
        for twin_id, revision in read_batch(folder).twins.items():
            found[twin_id].add(revision)
    return {twin_id: tuple(sorted(each)) for twin_id, each in found.items()}


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
        record["language"]["category"],
        record["source"]["license"] or UNKNOWN,
        record["source"]["attribution"],
        record["source"]["sha256"],
        any(stage.get("rehearsal") for stage in record["provenance"]["stages"].values()),
    )
