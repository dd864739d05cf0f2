"""Selection of the episodes to publish: those whose objects all come from twins under an allowed licence."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from manitwin.dataset.publish.licences import UNKNOWN, LicencePolicy, Selection, Terms, select
from manitwin.episodes.attempts import Attempt
from manitwin.episodes.batch import read_batch
from manitwin.episodes.episodes_stage import EPISODES
from manitwin.episodes.hdf5_file import EpisodeFile
from manitwin.errors import UsageError
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.store import RECORD, parse_record


@dataclass(frozen=True)
class TwinInEpisodes:
    """A twin shown in published episodes: its attribution, and the numbers of these episodes.

    ``revisions`` are those at the time of the batches; its present revision may differ (``--retire`` amends it).
    """

    twin_id: str
    category: str
    license: str
    attribution: str | None
    source_sha256: str
    rehearsal: bool
    revisions: tuple[str, ...] = ()
    episodes: tuple[int, ...] = ()

    @property
    def terms(self) -> Terms:
        """Terms that decide whether it may be published."""
        return Terms(self.license, self.rehearsal)


@dataclass(frozen=True)
class EpisodeSelection:
    """The episodes to publish, the twins of all their objects, and the ids of the allowed target twins."""

    episodes: Selection
    twins: tuple[TwinInEpisodes, ...]
    allowed_targets: frozenset[str]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The twins as table rows."""
        return [asdict(twin) for twin in self.twins]

    def counts_attempt(self, attempt: Attempt) -> bool:
        """Tell whether success rates may count an attempt: its target's licence allows it."""
        return not attempt.twin_id or attempt.twin_id in self.allowed_targets

    def includes_attempt(self, attempt: Attempt) -> bool:
        """Tell whether an attempt's row is published."""
        return self.counts_attempt(attempt) and attempt.episode_id not in self.episodes.kept_back


def choose_episodes(
    batches: Sequence[Path],
    attempts: Iterable[Attempt],
    source: TwinSource,
    license_allow: Iterable[str] | None,
    *,
    with_rehearsals: bool = False,
) -> EpisodeSelection:
    """Select among the kept episodes of batches by the licences of all objects in them, not only the target.

    An excluded episode is counted under the licences that exclude it: ``CC-BY-NC-4.0``, or ``CC-BY-NC-4.0 + unknown``.
    Episodes with a twin that a rehearsal server contributed to are excluded unless ``with_rehearsals``. Raises UsageError if
    a twin no longer exists or no episode may be published, EpisodesError for a batch that cannot be read.
    """
    twin, allowed = cache(partial(_read, source)), LicencePolicy(license_allow, with_rehearsals)
    objects = dict(objects_of_episodes(batches))
    terms = ((episode_id, [twin(each).terms for each in ids]) for episode_id, ids in objects.items())
    selection = select("kept episode", terms, allowed)
    seen = defaultdict[str, list[int]](list)
    for episode_id, number in selection.published.items():
        for each in objects[episode_id]:
            seen[each].append(number)
    targets = {attempt.twin_id for attempt in attempts if attempt.twin_id}
    targets = {each for each in targets if allowed.refusal([twin(each).terms]) is None}
    revisions = revisions_of_twins(batches)
    shown = (
        replace(twin(each), revisions=revisions.get(each, ()), episodes=tuple(seen[each]))
        for each in sorted(set(seen) | targets)
    )
    return EpisodeSelection(selection, tuple(shown), frozenset(targets))


def revisions_of_twins(batches: Iterable[Path]) -> dict[str, tuple[str, ...]]:
    """Return the sorted revisions of each twin in the batches; a twin amended between two batches has several."""
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
                said = file.metadata(number)
                yield said["attempt"]["episode_id"], frozenset(thing["twin_id"] for thing in said["objects"])


def _read(source: TwinSource, twin_id: str) -> TwinInEpisodes:
    record = parse_record(source.record_bytes(twin_id), f"{source.root.url}/{source.root.twin_name(twin_id)}/{RECORD}")
    if record.language is None:
        raise UsageError(
            f"{source.root.url}: twin {twin_id} has been rejected; give the data set of the episodes (--twins)"
        )
    return TwinInEpisodes(
        twin_id,
        record.language.category,
        record.source.license or UNKNOWN,
        record.source.attribution,
        record.source.sha256,
        bool(record.provenance.rehearsed),
    )
