"""Whether the twins of scenes are those that came to rest in them: one that was made again may stand otherwise."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from manitwin.errors import TwinError, UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.formats.plurals import counted
from manitwin.scenes.scene import SceneRecord
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.record_digests import TwinState, state_of
from manitwin.twin.store import RECORD, REMEDY, in_present_version

MOST_NAMED = 3
RESAMPLE = "sample the layouts again into a new folder, or name the data set as it was with --twins"


@dataclass(frozen=True)
class ChangedTwins:
    """The twins of scenes that are others than in these, by id with their category.

    ``changed`` have other hulls, another mass, contact or placements, or are no accepted twins any more. Of ``unknown`` a scene
    of an earlier version has another revision, which a retired grasp makes as well as another shape.
    """

    changed: Mapping[str, str]
    unknown: Mapping[str, str]
    stale_scenes: int
    scenes: int

    @property
    def line(self) -> str | None:
        """A line that names what has changed; None where nothing has."""
        if not self.changed:
            return None
        return (
            f"{_named(self.changed)} changed in shape, mass, contact or placements since coming to rest in"
            f" {self.stale_scenes:,} of {counted(self.scenes, 'scenes')}"
        )

    @property
    def remark(self) -> str | None:
        """A line on twins of which nobody knows whether they have changed; None where there are none."""
        if not self.unknown:
            return None
        return (
            f"{_named(self.unknown)}: another revision than in scenes of an earlier version, which do not tell whether shape and"
            " mass are the same; if built again since, sample the layouts again into a new folder"
        )


def changed_twins(scenes: Iterable[SceneRecord], now: Callable[[str], TwinState | None]) -> ChangedTwins:
    """Compare the twins of scenes with what they are ``now``: None for one that is no accepted twin any more.

    Twins whose records cannot be read (TwinError) are left out.
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
            except TwinError:  # what reads it says so, of what is made with it alone
                continue
            if state is not None and each.body_sha256 is None and state.revision != each.revision:
                unknown[each.twin_id] = each.category
            elif state is None or (each.body_sha256 is not None and state.body_sha256 != each.body_sha256):
                changed[each.twin_id] = each.category
                found = True
        stale += found
    return ChangedTwins(dict(sorted(changed.items())), dict(sorted(unknown.items())), stale, count)


class StatesNow:
    """What the twins of a data set are now, each read once: call it with an id. None for one that was rejected.

    Raises UsageError where there is no such twin, TwinError where its record cannot be read.
    """

    def __init__(self, twins: TwinSource):
        self._twins = twins
        self.states: dict[str, TwinState | None] = {}

    def __call__(self, twin_id: str) -> TwinState | None:
        """Return what a twin is now."""
        if twin_id not in self.states:
            name = f"{self._twins.root.url}: {twin_id}/{RECORD}"
            said = parse_json_object(self._twins.record_bytes(twin_id), name, TwinError, remedy=REMEDY)
            data = in_present_version(said, name)
            self.states[twin_id] = None if data.get("status") == "rejected" else state_of(data, name)
        return self.states[twin_id]


def require_same_twins(scenes: Iterable[SceneRecord], twins: TwinSource, place: str) -> tuple[StatesNow, list[str]]:
    """Return what the twins of scenes are now, and remarks; raises UsageError naming ``place`` where one stands otherwise."""
    now = StatesNow(twins)
    found = changed_twins(scenes, now)
    if found.line is not None:
        raise UsageError(f"{place}: {found.line}; {RESAMPLE}")
    return now, [] if found.remark is None else [f"{place}: {found.remark}"]


def _named(twins: Mapping[str, str]) -> str:
    some = ", ".join(f"{twin_id} ({category})" for twin_id, category in list(twins.items())[:MOST_NAMED])
    more = f" and {len(twins) - MOST_NAMED} more" if len(twins) > MOST_NAMED else ""
    return f"twins {some}{more}" if len(twins) > 1 else f"twin {some}"
