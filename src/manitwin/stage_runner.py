"""Run one stage, or take its result up again: results live in ``.work/<twin_id>/<stage>/<key>``, by what decided them."""

from __future__ import annotations

import json
import os
import resource
import shutil
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from manitwin.errors import ManiTwinError
from manitwin.stages.stage import Draft, Stage, is_field
from manitwin.store import canonical_json, sha256_of_artifact, sha256_of_json, write_bytes_atomically

RESULT = "result.json"


@dataclass(frozen=True)
class StageCost:
    """What a stage cost when it ran: wall and CPU seconds, and money."""

    seconds: float
    cpu_seconds: float
    cost_usd: float


def stage_key(stage: Stage, draft: Draft) -> str:
    """Return the hash of everything that decides a stage's result: same key, same bytes."""
    reads = {
        n: sha256_of_json(draft.field(n)) if is_field(n) else sha256_of_artifact(draft.path(n))
        for n in _present(stage, draft)
    }
    decides = {
        "twin": draft.twin_id,
        "name": stage.name,
        "version": stage.version,
        "settings": stage.settings.model_dump(mode="json"),
        "backend": stage.backend,
        "model": stage.model,
        "seed": draft.seed,
        "reads": reads,
    }
    return sha256_of_json(decides)[:24]


def _present(stage: Stage, draft: Draft) -> list[str]:
    """Return what the stage reads; a name that ends in ``?`` is read where it is there."""
    names = []
    for name in stage.reads:
        optional = name.endswith("?")
        name = name.removesuffix("?")
        if not optional or name in draft.fields or name in draft.paths:
            names.append(name)
    return names


def run_stage(stage: Stage, draft: Draft, work: Path) -> StageCost:
    """Bring a stage's results into the draft, from an earlier run where one with the same key is there.

    Raises what the stage raises; then nothing of it is left behind. Raises ManiTwinError where a stage does not write what
    it declares: that is a defect of the stage.
    """
    key = stage_key(stage, draft)
    place = work / stage.name / key
    if not (place / RESULT).is_file():
        _run_into(stage, draft, place)
    result = json.loads((place / RESULT).read_text())
    for name in stage.writes:
        if is_field(name):
            draft.fields[name] = result["fields"][name]
        else:
            draft.paths[name] = place / name
    return StageCost(**result["cost"])


def _cpu_seconds() -> float:
    return time.process_time() + sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])


def _run_into(stage: Stage, draft: Draft, place: Path) -> None:
    fresh = place.with_name(f".{place.name}.{os.getpid()}")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir(parents=True)
    try:
        started, cpu_started = time.perf_counter(), _cpu_seconds()
        fields = stage.run(draft, fresh)
        cost = {"seconds": time.perf_counter() - started, "cpu_seconds": _cpu_seconds() - cpu_started}
        _check_writes(stage, fields, fresh)
        content = {"fields": fields, "cost": {**cost, "cost_usd": 0.0}}
        write_bytes_atomically(fresh / RESULT, canonical_json(content).encode())
        shutil.rmtree(place, ignore_errors=True)
        os.rename(fresh, place)
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


def _check_writes(stage: Stage, fields: dict[str, Any], folder: Path) -> None:
    declared = set(stage.writes)
    written = set(fields) | {f"{p.name}/" if p.is_dir() else p.name for p in folder.iterdir()}
    if declared != written:
        raise ManiTwinError(f"stage {stage.name!r} declares {sorted(declared)} and wrote {sorted(written)}")
