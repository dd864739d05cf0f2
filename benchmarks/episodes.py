"""Print the figures of folders of episodes, one row each: outcomes of the attempts, the worst object, errors and cost.

    manitwin trajectories TWINS -n 625 --seed 11 -o calibration          determines only the retired grasps
    manitwin trajectories TWINS -n 1250 --seed 21 -o empty --no-retire
    manitwin trajectories TWINS -n 1250 --seed 31 -o five --others 5 --no-retire
    python benchmarks/episodes.py empty five

An object without any executed episode counts among the attempted ones and is listed. CPU seconds are those of the stages in the
workers.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

import numpy as np

from manitwin.engine.ledger.location import local_ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.episodes.attempts import ATTEMPTS, read_attempts
from manitwin.twin.dataset_root import DatasetRoot


def figures(folder: Path) -> str:
    """Return a row for one folder."""
    attempts = list(read_attempts(folder / ATTEMPTS))
    by_object = defaultdict(list)
    for attempt in attempts:
        by_object[attempt.twin_id, attempt.category].append(attempt)
    executed = [a for a in attempts if a.planned]
    kept = [a for a in executed if a.outcome == "kept"]
    rates = {
        f"{category} {twin_id[:4]}": (sum(a.succeeded for a in some if a.planned), sum(a.planned for a in some))
        for (twin_id, category), some in by_object.items()
    }
    shares = sorted((good / tried, good, tried, name) for name, (good, tried) in rates.items() if tried)
    many = sum(tried >= 50 for _, _, tried, _ in shares)
    errors = np.array([a.position_error_m for a in kept if a.position_error_m is not None])
    placed = (
        f"placement error median {1000 * np.median(errors):.2f} mm, 95 % {1000 * np.quantile(errors, 0.95):.1f} mm"
        if len(errors)
        else "nothing is placed"
    )
    with read_ledger(local_ledger(DatasetRoot(folder))) as ledger:
        (cpu,) = ledger.execute("SELECT sum(cpu_seconds) FROM stages").fetchone()
    dead = [name for name, (_, tried) in rates.items() if not tried]
    worst = ", ".join(f"{name} {good}/{tried}" for share, good, tried, name in shares[:3])
    return (
        f"{folder.name}: {len(attempts)} attempted, {len(executed)} executed ({len(executed) / len(attempts):.1%}), "
        f"{sum(a.succeeded for a in executed)} succeeded ({sum(a.succeeded for a in executed) / len(executed):.1%}), "
        f"{len(kept)} kept; {many} objects with 50 executed or more, worst {worst}; never executed: {', '.join(dead) or 'none'}; "
        f"{placed}; "
        f"length {np.mean([a.length_s for a in kept]):.2f} s; {cpu / len(attempts):.3f} CPU-s an attempt"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    for each in parser.parse_args().folders:
        print(figures(each))
