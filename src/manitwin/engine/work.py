"""The results of one item's stages: kept below the data set's root, and on this machine where that is a URL."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from manitwin.engine.ledger.location import cache_folder
from manitwin.engine.stage import Draft, Stage, is_field
from manitwin.engine.stage_runner import LOST, RESULT, StageCost, StageRun, run_stage, stage_key, take_up
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import WORK

StageKey = tuple[str, str]
"""A stage's name and the key of its result."""


class WorkFolder:
    """Where the stages of one item read and write.

    Owns: the local folder. Of a URL it holds copies: a result is complete there once its ``result.json`` is, which goes last.
    """

    def __init__(self, root: DatasetRoot, item_id: str, cache: Path):
        self.root, self.name = root, f"{WORK}/{item_id}"
        self.place = (root.local or cache) / WORK / item_id
        self.fresh = self.place.with_name(f"{item_id}.finished")  # where the finished folder is put together

    def has(self, stage: str, key: str) -> bool:
        """Tell whether a result is there."""
        return (self.place / stage / key / RESULT).is_file() or (
            self.root.local is None and self.root.exists(f"{self.name}/{stage}/{key}/{RESULT}")
        )

    def load(
        self, draft: Draft, done: Iterable[StageKey], stages: dict[str, Stage], wanted: set[str] | None
    ) -> dict[str, StageCost]:
        """Bring the results of stages into the draft, of files and folders only the ``wanted`` ones (None: all)."""
        costs = {}
        for name, key in done:
            writes = stages[name].writes
            self._fetch(name, key, [w for w in writes if not is_field(w) and (wanted is None or w in wanted)])
            costs[name] = take_up(self.place / name / key, writes, draft)
        return costs

    def run(self, stage: Stage, draft: Draft) -> StageRun:
        """Run a stage, or find its result, and leave it below the root."""
        if self.root.local is not None:
            return run_stage(stage, draft, self.place)
        with self._shared_bill(stage.name):
            ran = run_stage(stage, draft, self.place)
        if not ran.reused:
            self._publish(stage.name, ran.key)
        return ran

    @contextmanager
    def _shared_bill(self, stage: str) -> Iterator[None]:
        """Keep what was charged in vain at the URL: the next attempt may be on another machine."""
        name, place = f"{self.name}/{stage}/{LOST}", self.place / stage / LOST
        if self.root.exists(name):
            self.root.fetch_file(name, place)
        try:
            yield
        except BaseException:
            if place.is_file():
                self.root.put_file(place, name)
            raise
        self.root.remove(name)

    def find(self, stage: Stage, draft: Draft) -> StageRun | None:
        """Return the stage's result where it is there already, and bring it into the draft."""
        key = stage_key(stage, draft)
        if not self.has(stage.name, key):
            return None
        self._fetch(stage.name, key, [])
        return StageRun(key, take_up(self.place / stage.name / key, stage.writes, draft), True)

    def sweep(self) -> None:
        """Delete what stages that were cut off left half-made."""
        for stale in (*self.place.glob("*/.*"), self.fresh):
            shutil.rmtree(stale, ignore_errors=True)

    def drop(self) -> None:
        """Delete everything: the item has ended and nobody wants to resume it."""
        shutil.rmtree(self.place, ignore_errors=True)
        if self.root.local is None:
            self.root.remove(self.name)

    def _fetch(self, stage: str, key: str, artifacts: list[str]) -> None:
        if self.root.local is not None:
            return
        place, name = self.place / stage / key, f"{self.name}/{stage}/{key}"
        for artifact in [*artifacts, RESULT]:
            if (place / artifact).exists():
                continue
            below = (
                self.root.names_below(f"{name}/{artifact.rstrip('/')}")
                if artifact.endswith("/")
                else [f"{name}/{artifact}"]
            )
            for each in below:
                target = place / each.removeprefix(f"{name}/")
                beside = target.with_name(f".{target.name}.{os.getpid()}")
                self.root.fetch_file(each, beside)
                os.replace(beside, target)

    def _publish(self, stage: str, key: str) -> None:
        place = self.place / stage / key
        files = sorted((p for p in place.rglob("*") if p.is_file()), key=lambda p: (p.name == RESULT, p))
        for path in files:
            self.root.put_file(path, f"{self.name}/{stage}/{key}/{path.relative_to(place).as_posix()}")


def sweep(root: DatasetRoot, item_id: str) -> None:
    """Delete what workers left half-made of an item."""
    WorkFolder(root, item_id, cache_folder(root)).sweep()
