"""Forecast CPU time, service costs, accepted twins and disk space for many inputs from the inputs already built in a data set.

The built inputs and the future inputs are assumed to be draws from one population. Intervals (95 %) of means are percentile
bootstrap intervals (Efron 1979), those of shares are Wilson intervals (1927). Quantities that were not measured are None.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from manitwin.dataset.index.query import Index
from manitwin.errors import TwinError, UsageError
from manitwin.formats.printable import printable_line
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.proportions import wilson_interval

LEAST_INPUTS = 5
"""Minimum number of built inputs; with fewer, a single outlier dominates the forecast."""
MOST_SIZED = 200
"""Number of inputs, drawn by the seed, whose folder sizes are measured."""
RESAMPLES = 1000
MOST_RESAMPLED = 5_000
"""Number of inputs above which a random subset of this size is bootstrapped; the interval is then wider than necessary, never
narrower.
"""
LARGEST_MEMORY_GB = 1e6
WORK = ".work"


@dataclass(frozen=True)
class Amount:
    """A forecast quantity for all future inputs with its 95 % interval."""

    value: float
    low: float
    high: float

    def times(self, factor: float) -> Amount:
        """Return the amount and its interval multiplied by a factor."""
        return Amount(self.value * factor, self.low * factor, self.high * factor)


@dataclass(frozen=True)
class Forecast:
    """Resources that ``items`` inputs would take, estimated from ``measured`` inputs.

    ``hours`` is the wall time on ``cores`` cores that are always busy, a lower bound for a real run. ``usd`` is None if the price
    of a core hour is not given. ``work_bytes`` is the size of stage results, which can be deleted after the run; None if none are
    kept. ``memory_bytes`` is the memory limit summed over all workers, since actual use is not recorded. ``stages`` maps each
    stage to its share of the CPU time.
    """

    items: int
    cores: int
    measured: int
    accepted: Amount
    cpu_hours: Amount
    hours: Amount
    slowest_cpu_s: float
    services_usd: Amount
    usd: Amount | None
    twins_bytes: Amount
    work_bytes: Amount | None
    index_bytes: float
    ledger_bytes: float
    memory_bytes: float | None
    stages: dict[str, float]

    def document(self) -> dict[str, Any]:
        """Return the forecast as plain values for JSON."""
        plain = dict(vars(self))
        return {name: dict(vars(value)) if isinstance(value, Amount) else value for name, value in plain.items()}


def forecast(
    root: DatasetRoot, items: int, cores: int, *, core_hour_usd: float | None = None, seed: int = 0
) -> Forecast:
    """Forecast the resources of ``items`` inputs on ``cores`` cores; raises UsageError if too little was measured."""
    index = Index(root)
    status = index.select("twins", columns=["twin_id"]).to_pydict()["twin_id"]
    rejected = index.select("rejections", columns=["twin_id"]).to_pydict()["twin_id"]
    ids = sorted({*status, *rejected})
    if len(ids) < LEAST_INPUTS:
        raise UsageError(
            f"{root.path}: {len(ids)} inputs were built, but an estimate needs at least {LEAST_INPUTS}; build more"
            f" first"
        )
    place = {twin_id: number for number, twin_id in enumerate(ids)}
    rows = index.select("stages", columns=["twin_id", "stage", "cpu_seconds", "cost_usd"]).to_pydict()
    cpu_s, usd, stages = np.zeros(len(ids)), np.zeros(len(ids)), dict[str, float]()
    for twin_id, stage, seconds, cost in zip(*(rows[name] for name in rows), strict=True):
        if twin_id not in place:
            raise UsageError(
                f"{root.path}: its index has stages of {printable_line(twin_id)}, but neither a twin nor a"
                f" rejection; rebuild it with `manitwin index {root.path}`"
            )
        cpu_s[place[twin_id]] += seconds or 0.0
        usd[place[twin_id]] += cost or 0.0
        stages[stage] = stages.get(stage, 0.0) + (seconds or 0.0)
    if not cpu_s.any():
        raise UsageError(
            f"{root.path}: it has no recorded CPU time of stages; run `manitwin index {root.path}` and try again"
        )
    rng = np.random.default_rng(seed)
    busy = min(cores, items)  # one input uses one core
    cpu_hours = _extrapolate(cpu_s / 3600, items, rng)
    accepted = len(set(status) - set(rejected))
    low, high = wilson_interval(accepted, len(ids))
    services = _extrapolate(usd, items, rng)
    drawn = [ids[i] for i in sorted(rng.choice(len(ids), min(len(ids), MOST_SIZED), replace=False))]
    work = np.array([_bytes_below(root, f"{WORK}/{each}") for each in drawn])
    return Forecast(
        items=items,
        cores=cores,
        measured=len(ids),
        accepted=Amount(items * accepted / len(ids), items * low, items * high),
        cpu_hours=cpu_hours,
        hours=cpu_hours.times(1 / busy),
        slowest_cpu_s=float(cpu_s.max()),
        services_usd=services,
        usd=None
        if core_hour_usd is None
        else Amount(*(c * core_hour_usd + s for c, s in zip(_as_tuple(cpu_hours), _as_tuple(services), strict=True))),
        twins_bytes=_extrapolate(np.array([_bytes_below(root, root.twin_name(each)) for each in drawn]), items, rng),
        work_bytes=_extrapolate(work, items, rng) if work.any() else None,
        index_bytes=_bytes_below(root, "index") / len(ids) * items,
        ledger_bytes=_bytes_of(root, "ledger.sqlite") / len(ids) * items,
        memory_bytes=_memory_bytes(root, busy),
        stages={name: seconds / cpu_s.sum() for name, seconds in sorted(stages.items(), key=lambda each: -each[1])},
    )


def _as_tuple(amount: Amount) -> tuple[float, float, float]:
    return amount.value, amount.low, amount.high


def _extrapolate(each: np.ndarray, items: int, rng: np.random.Generator) -> Amount:
    """Return the sum over ``items`` inputs, given a sample ``each`` (N,) of them, with the bootstrap interval of the mean."""
    kept = each if len(each) <= MOST_RESAMPLED else rng.choice(each, MOST_RESAMPLED, replace=False)
    counts = rng.multinomial(len(kept), np.full(len(kept), 1 / len(kept)), size=RESAMPLES)
    low, high = np.percentile(counts @ kept / len(kept), [2.5, 97.5])
    mean = float(each.mean())
    return Amount(items * mean, items * min(float(low), mean), items * max(float(high), mean))


def _bytes_below(root: DatasetRoot, folder: str) -> float:
    return float(sum(size or 0 for size in root.sizes_below(folder).values()))


def _bytes_of(root: DatasetRoot, name: str) -> float:
    return float(root.fs.size(root.full(name)) or 0) if root.exists(name) else 0.0


def _memory_bytes(root: DatasetRoot, cores: int) -> float | None:
    """Return the summed memory limit of ``cores`` workers from the data set's configuration; None if it is not stated."""
    try:
        run = root.read_json("config.json").get("run")
    except (TwinError, FileNotFoundError):
        return None
    limit_gb = run.get("memory_gb") if isinstance(run, dict) else None
    if not isinstance(limit_gb, (int, float)) or not 0 < limit_gb <= LARGEST_MEMORY_GB:
        return None
    return float(limit_gb * 2**30 * cores)
