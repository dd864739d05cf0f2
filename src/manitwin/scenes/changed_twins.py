"""Detection of twins that were rebuilt after a scene was sampled, and may rest differently now."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from manitwin.errors import TwinError, UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.formats.plurals import counted
from manitwin.scenes.scene import SceneRecord
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.record_digests import TwinState, twin_state
from manitwin.twin.store import RECORD, REMEDY, migrate_content

MOST_NAMED = 3
RESAMPLE = "sample the layouts again into a new folder, or name the data set as it was with --twins"


@dataclass(frozen=True)
class ChangedTwins:
    """Twins that differ from those in scenes, by id with their category.

    ``changed`` have other hulls, another mass, contact or placements, or are not accepted any more. ``unknown`` have another
    revision than a scene of an earlier version, which may result from a retired grasp as well as from another shape.
    """

    changed: Mapping[str, str]
    unknown: Mapping[str, str]
    stale_scenes: int
    scenes: int

    @property
    def changed_remark(self) -> str | None:
        """A line that names the changed twins; None if there are none."""
        if not self.changed:
            return None
        return (
            f"{_named(self.changed)} changed in shape, mass, contact or placements since coming to rest in"
            f" {self.stale_scenes:,} of {counted(self.scenes, 'scenes')}"
        )

    @property
    def remark(self) -> str | None:
        """A line on twins of which it is unknown whether they changed; None if there are none."""
        if not self.unknown:
            return None
        return (
            f"{_named(self.unknown)}: another revision than in scenes of an earlier version, which do not tell whether shape and"
            " mass are the same; if built again since, sample the layouts again into a new folder"
        )


def find_changed_twins(scenes: Iterable[SceneRecord], now: Callable[[str], TwinState | None]) -> ChangedTwins:
    """Compare the twins of scenes with their current states, where ``now`` returns None for one that is not accepted any more.

    Twins with unreadable records (TwinError) are skipped.
    """
    changed: dict[str, str] = {}
    unknown: dict[str, str] = {}
    stale = count = 0
    for scene in scenes:
        count += 1
        found = False
        for each in scene.objects:
            try:
                state = now(each.twin_id)
            except TwinError:  # reading the twin reports the error, only for what uses it
                continue
            if state is not None and each.body_sha256 is None and state.revision != each.revision:
                unknown[each.twin_id] = each.category
            elif state is None or (each.body_sha256 is not None and state.body_sha256 != each.body_sha256):
                changed[each.twin_id] = each.category
                found = True
        stale += found
    return ChangedTwins(dict(sorted(changed.items())), dict(sorted(unknown.items())), stale, count)


class CurrentTwinStates:
    """The current states of a data set's twins, each read once: call it with an id. None for a rejected twin.

    Raises UsageError for a missing twin, TwinError for an unreadable record.
    """

    def __init__(self, twins: TwinSource):
        self._twins = twins
        self.states: dict[str, TwinState | None] = {}

    def __call__(self, twin_id: str) -> TwinState | None:
        """Return the current state of a twin."""
        if twin_id not in self.states:
            name = f"{self._twins.root.url}: {twin_id}/{RECORD}"
            said = parse_json_object(self._twins.record_bytes(twin_id), name, TwinError, remedy=REMEDY)
            data = migrate_content(said, name)
            self.states[twin_id] = None if data.get("status") == "rejected" else twin_state(data, name)
        return self.states[twin_id]


def require_same_twins(
    scenes: Iterable[SceneRecord], twins: TwinSource, place: str
) -> tuple[CurrentTwinStates, list[str]]:
    """Return the current states of the twins of scenes, and remarks; raises UsageError naming ``place`` if one changed."""
    now = CurrentTwinStates(twins)
    found = find_changed_twins(scenes, now)
    if found.changed_remark is not None:
        raise UsageError(f"{place}: {found.changed_remark}; {RESAMPLE}")
    return now, [] if found.remark is None else [f"{place}: {found.remark}"]


def _named(twins: Mapping[str, str]) -> str:
    some = ", ".join(f"{twin_id} ({category})" for twin_id, category in list(twins.items())[:MOST_NAMED])
    more = f" and {len(twins) - MOST_NAMED} more" if len(twins) > MOST_NAMED else ""
    return f"twins {some}{more}" if len(twins) > 1 else f"twin {some}"
