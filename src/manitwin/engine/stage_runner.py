"""Run one stage, or take its result up again: results live in ``.work/<item_id>/<stage>/<key>``, by what decided them.

``result.json`` beside a stage's files holds its fields, the digests of all that it wrote, what it cost, and, where its backend or
that of a stage before it was a rehearsal server, the names of these stages.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import time
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from manitwin.engine.charges import Bill, counted
from manitwin.engine.stage import Draft, Stage, is_field
from manitwin.errors import ManiTwinError
from manitwin.twin.store import canonical_json, sha256_of_artifact, sha256_of_json, write_bytes_atomically

RESULT = "result.json"
JOBS = "jobs"
"""The folder of a twin's work that remembers jobs of services, beside those of the stages."""
LOST = "lost_usd.json"
"""What services charged for attempts at a stage that came to nothing: the one that succeeds, or is rejected, counts it."""


@dataclass(frozen=True)
class StageCost:
    """What a stage cost when it ran: wall and CPU seconds, and money."""

    seconds: float
    cpu_seconds: float
    cost_usd: float


@dataclass(frozen=True)
class StageRun:
    """How a stage came by its result: the key, what it cost when it ran, and whether that was in an earlier run.

    ``charged_usd`` is what services charged for it now; ``cost`` has what they charged in vain before as well.
    """

    key: str
    cost: StageCost
    reused: bool
    charged_usd: float = 0.0


def stage_key(stage: Stage, draft: Draft) -> str:
    """Return the hash of everything that decides a stage's result: same key, same bytes."""
    decides = {
        "twin": draft.item_id,
        "name": stage.name,
        "version": stage.version,
        "settings": stage.settings.model_dump(mode="json"),
        "backend": stage.backend,
        "model": stage.model,
        "seed": draft.seed,
        "reads": {name: _digest(name, draft) for name in present_reads(stage, draft.names())},
    }
    return sha256_of_json(decides)[:24]


def present_reads(stage: Stage, names: Collection[str]) -> list[str]:
    """Return what the stage reads, given the names that are there; one that ends in ``?`` is read where it is there."""
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


def run_stage(stage: Stage, draft: Draft, work: Path) -> StageRun:
    """Bring a stage's results into the draft, from an earlier run where one with the same key is there.

    Raises what the stage raises; then nothing of it is left behind. Raises ManiTwinError where a stage does not write what
    it declares: that is a defect of the stage.
    """
    key = stage_key(stage, draft)
    place = work / stage.name / key
    reused = (place / RESULT).is_file()
    if not reused:
        _run_into(stage, draft, place)
    return StageRun(key, take_up(place, stage.writes, draft), reused)


def take_up(place: Path, names: Iterable[str], draft: Draft) -> StageCost:
    """Bring what a stage wrote at ``place`` into the draft."""
    result = json.loads((place / RESULT).read_text())
    for name in names:
        if is_field(name):
            draft.fields[name] = result["fields"][name]
        else:
            draft.paths[name] = place / name
        draft.digests[name] = result["digests"][name]
    draft.rehearsed.update(result.get("rehearsed", ()))  # results of earlier versions do not say
    return StageCost(**result["cost"])


def _cpu_seconds() -> float:
    return time.process_time() + sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])


@contextmanager
def _kept_bill(stage_folder: Path) -> Iterator[Bill]:
    """Count what is charged; where the work fails, keep it for the attempt that will not."""
    with counted() as bill:
        try:
            yield bill
        except BaseException:
            if bill.usd:
                total = lost_usd(stage_folder) + bill.usd
                write_bytes_atomically(stage_folder / LOST, canonical_json(total).encode())
            raise


def lost_usd(stage_folder: Path) -> float:
    """Return what was charged for attempts at a stage that came to nothing."""
    lost = stage_folder / LOST
    return float(json.loads(lost.read_bytes())) if lost.is_file() else 0.0


def _run_into(stage: Stage, draft: Draft, place: Path) -> None:
    fresh = place.with_name(f".{place.name}.{os.getpid()}")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir(parents=True)
    try:
        started, cpu_started = time.perf_counter(), _cpu_seconds()
        with _kept_bill(place.parent) as bill:
            try:
                fields = stage.run(draft, fresh)
            finally:
                draft.rehearsed.update([stage.name] if bill.rehearsed else [])
        cost = {"seconds": time.perf_counter() - started, "cpu_seconds": _cpu_seconds() - cpu_started}
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
