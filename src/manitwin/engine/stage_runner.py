"""Run a stage or reuse its cached result: results live in ``.work/<item_id>/<stage>/<key>``, keyed by their inputs.

They are stored below the data set's root; if that is a URL, this machine keeps copies. ``result.json`` beside a stage's files
holds its fields, the digests of everything it wrote, its cost, and the names of the stages, among it and its predecessors,
whose backend was a rehearsal server.
"""

from __future__ import annotations

import logging
import os
import resource
import shutil
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from manitwin.engine.ledger.location import cache_folder
from manitwin.engine.lost_charges import LOST, keep_lost_charges, lost_usd
from manitwin.engine.stage import Draft, Stage, is_field
from manitwin.errors import ManiTwinError, TwinError
from manitwin.formats.json_file import read_json_object
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import WORK, canonical_json, sha256_of_artifact, sha256_of_json, write_bytes_atomically

RUN = logging.getLogger("manitwin.run")
RESULT = "result.json"
_ANEW = "remove its folder to run the stage again"
JOBS = "jobs"
"""The folder, beside those of the stages, with the ids of submitted service jobs."""


@dataclass(frozen=True)
class StageCost:
    """The cost of a stage when it ran: wall and CPU seconds, and charges in USD."""

    seconds: float
    cpu_seconds: float
    cost_usd: float


@dataclass(frozen=True)
class StageRun:
    """The outcome of a stage: its key, its cost when it ran, and whether the result was reused from an earlier run.

    ``charged_usd`` is what services charged in this run; ``cost`` also includes the charges of failed attempts.
    """

    key: str
    cost: StageCost
    reused: bool
    charged_usd: float = 0.0


def stage_key(stage: Stage, draft: Draft) -> str:
    """Return the hash of everything that determines a stage's result: equal keys mean equal bytes."""
    decides = {
        "twin": draft.item_id,
        "name": stage.name,
        "version": stage.version,
        "settings": stage.settings.model_dump(mode="json"),
        "backend": stage.backend,
        "model": stage.model,
        "seed": draft.seed,
        "reads": {name: _digest(name, draft) for name in available_reads(stage, draft.names())},
    }
    if draft.amendments.get(stage.name):
        decides["amendment"] = draft.amendments[stage.name]
    return sha256_of_json(decides)[:24]


def available_reads(stage: Stage, names: Collection[str]) -> list[str]:
    """Return the artifacts that a stage reads out of those available; optional ones (``?``) only if available."""
    reads = []
    for name in stage.reads:
        optional = name.endswith("?")
        name = name.removesuffix("?")
        if not optional or name in names:
            reads.append(name)
    return reads


def _digest(name: str, draft: Draft) -> str:
    if name not in draft.digests:
        value = sha256_of_json(draft.field(name)) if is_field(name) else sha256_of_artifact(draft.path(name))
        draft.digests[name] = value
    return draft.digests[name]


def run_stage(stage: Stage, draft: Draft, work: Path, require_same: Callable[[], None] = lambda: None) -> StageRun:
    """Run a stage, or reuse the result with the same key, and load the result into the draft.

    ``require_same`` raises if the stage's input has changed since the key was computed. An exception of the stage propagates,
    and its partial output is deleted. Raises ManiTwinError if a stage does not write exactly what it declares, which is a bug.
    """
    key = stage_key(stage, draft)
    place = work / stage.name / key
    reused = is_complete_result(place)
    if not reused:
        _run_into(stage, draft, place, require_same)
    return StageRun(key, load_result(place, stage.writes, draft), reused)


def load_result(place: Path, names: Iterable[str], draft: Draft) -> StageCost:
    """Load the result of a stage at ``place`` into the draft; return its cost. Raises TwinError if it is malformed."""
    result = read_json_object(place / RESULT, TwinError, name=str(place / RESULT), remedy=_ANEW)
    try:
        fields = {name: result["fields"][name] for name in names if is_field(name)}
        digests = {name: result["digests"][name] for name in names}
        cost = StageCost(**result["cost"])
    except (KeyError, TypeError) as error:
        raise TwinError(f"{place / RESULT}: not a valid stage result ({error}); {_ANEW}") from error
    draft.fields.update(fields)
    draft.digests.update(digests)
    draft.paths.update({name: place / name for name in digests if name not in fields})
    draft.rehearsed.update(result.get("rehearsed", ()))  # results of earlier versions lack this entry
    return cost


def is_complete_result(place: Path, *, digests: bool = True) -> bool:
    """Return whether a result is complete and, with ``digests``, whether its files match their digests."""
    if not (place / RESULT).is_file():
        return False
    try:
        result = read_json_object(place / RESULT, TwinError)
        written = {name: digest for name, digest in result["digests"].items() if not is_field(name)}
        if not all((place / name).exists() for name in written):
            return False
        return not digests or all(sha256_of_artifact(place / name) == digest for name, digest in written.items())
    except (TwinError, KeyError, AttributeError, OSError):
        return False


def _cpu_seconds() -> float:
    return time.process_time() + sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])


def _run_into(stage: Stage, draft: Draft, place: Path, require_same: Callable[[], None]) -> None:
    fresh = place.with_name(f".{place.name}.{os.getpid()}")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir(parents=True)
    try:
        started, cpu_started = time.perf_counter(), _cpu_seconds()
        with keep_lost_charges(place.parent) as bill:
            try:
                fields = stage.run(draft, fresh)
            finally:
                draft.rehearsed.update([stage.name] if bill.rehearsed else [])
        cost = {"seconds": time.perf_counter() - started, "cpu_seconds": _cpu_seconds() - cpu_started}
        require_same()
        _check_writes(stage, fields, fresh)
        digests = {
            name: sha256_of_json(fields[name]) if is_field(name) else sha256_of_artifact(fresh / name)
            for name in stage.writes
        }
        content = {
            "fields": fields,
            "digests": digests,
            "cost": {**cost, "cost_usd": bill.usd + lost_usd(place.parent)},
            "rehearsed": sorted(draft.rehearsed),
        }
        write_bytes_atomically(fresh / RESULT, canonical_json(content).encode())
        shutil.rmtree(place, ignore_errors=True)
        os.rename(fresh, place)
        (place.parent / LOST).unlink(missing_ok=True)
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


def _check_writes(stage: Stage, fields: dict[str, Any], folder: Path) -> None:
    declared = set(stage.writes)
    written = set(fields) | {f"{p.name}/" if p.is_dir() else p.name for p in folder.iterdir()}
    if declared != written:
        raise ManiTwinError(f"stage {stage.name!r} declares {sorted(declared)} and wrote {sorted(written)}")


StageKey = tuple[str, str]
"""A stage's name and the key of its result."""


class WorkFolder:
    """The working folder of one item's stages.

    Owns the local folder. If the root is a URL, the folder holds copies; a result at the URL is complete once it has its
    ``result.json``, which is uploaded last.
    """

    def __init__(self, root: DatasetRoot, item_id: str, cache: Path):
        self.root, self.name = root, f"{WORK}/{item_id}"
        self.place = (root.local or cache) / WORK / item_id
        self.fresh = self.place.with_name(f"{item_id}.finished")  # the finished folder is assembled here

    def has(self, stage: str, key: str) -> bool:
        """Return whether a result exists."""
        return (self.place / stage / key / RESULT).is_file() or (
            self.root.local is None and self.root.exists(f"{self.name}/{stage}/{key}/{RESULT}")
        )

    def load(
        self, draft: Draft, done: Iterable[StageKey], stages: dict[str, Stage], wanted: set[str] | None
    ) -> dict[str, StageCost]:
        """Load the results of stages into the draft; fetch only the ``wanted`` files and folders (None: all). Return the
        costs.
        """
        costs = {}
        for name, key in done:
            writes = stages[name].writes
            self._fetch(name, key, [w for w in writes if not is_field(w) and (wanted is None or w in wanted)])
            costs[name] = load_result(self.place / name / key, writes, draft)
        return costs

    def run(self, stage: Stage, draft: Draft, require_same: Callable[[], None] = lambda: None) -> StageRun:
        """Run a stage or reuse its result, and store it below the root; ``require_same`` as in ``run_stage``."""
        if self.root.local is not None:
            return run_stage(stage, draft, self.place, require_same)
        with self._share_lost_charges(stage.name):
            ran = run_stage(stage, draft, self.place, require_same)
        if not ran.reused:
            self._publish(stage.name, ran.key)
        return ran

    @contextmanager
    def _share_lost_charges(self, stage: str) -> Iterator[None]:
        """Share the lost charges of a stage through the URL: the next attempt may run on another machine."""
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
        """Load a stage's existing result into the draft and return it; None if there is none."""
        key = stage_key(stage, draft)
        if not self.has(stage.name, key):
            return None
        place = self.place / stage.name / key
        if self.root.local is not None and not is_complete_result(place):
            RUN.warning("%s: damaged; the stage runs again", place)
            shutil.rmtree(place)
            return None
        self._fetch(stage.name, key, [])
        return StageRun(key, load_result(self.place / stage.name / key, stage.writes, draft), True)

    def sweep(self) -> None:
        """Delete partial results of interrupted stages."""
        for stale in (*self.place.glob("*/.*"), self.fresh):
            shutil.rmtree(stale, ignore_errors=True)

    def delete_results(self) -> None:
        """Delete all results: the item has ended and will not be resumed."""
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
    """Delete partial results of an item's interrupted stages."""
    WorkFolder(root, item_id, cache_folder(root)).sweep()
