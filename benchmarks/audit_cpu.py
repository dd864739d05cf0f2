"""Measure the cost of auditing each asset below folders: `python benchmarks/audit_cpu.py FOLDER... [--most N] [--seed S]`.

All rules are applied, without physics engines, in one warmed-up process, like a worker of an audit. CPU seconds are those of this
process and of the processes that it starts, so that other load on the machine does not count. Prints the median, the 90th
percentile and the mean for each folder and for all folders, and the most expensive assets. Runs on Linux only.
"""

from __future__ import annotations

import argparse
import os
import random
import statistics
from pathlib import Path

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.rules import RULES
from manitwin.assets.read import find_assets

TICKS = os.sysconf("SC_CLK_TCK")


def cpu_seconds() -> float:
    """Return the CPU seconds of this process and of all its descendants, including those that have ended."""
    return sum(_of(pid) for pid in _family(os.getpid()))


def _family(pid: int) -> list[int]:
    children = [
        int(word) for task in Path(f"/proc/{pid}/task").iterdir() for word in (task / "children").read_text().split()
    ]
    return [pid, *(each for child in children for each in _family(child))]


def _of(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:15])) / TICKS  # utime, stime, and the same of child processes that have ended


def main() -> None:
    """Audit the assets one after the other and print the cost of each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--most", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    every: list[tuple[float, Path]] = []
    warm = False
    for folder in options.folders:
        found = list(find_assets(folder))
        if len(found) > options.most:
            found = sorted(random.Random(options.seed).sample(found, options.most))
        if found and not warm:  # the imports of the first audit are not counted
            audit_path(found[0], RULES, root=folder)
            warm = True
        took = []
        for path in found:
            before = cpu_seconds()
            audit_path(path, RULES, root=folder)
            took.append((cpu_seconds() - before, path))
        every += took
        print(f"{folder.name}: {said([seconds for seconds, _ in took])}", flush=True)
    print(f"all: {said([seconds for seconds, _ in every])}")
    for seconds, path in sorted(every, reverse=True)[:10]:
        print(f"  {seconds:.2f} s {path}")


def said(seconds: list[float]) -> str:
    """Return the statistics of some assets as one line of text."""
    if not seconds:
        return "no assets"
    tenths = statistics.quantiles(seconds, n=10)[-1] if len(seconds) > 1 else seconds[0]
    middle, mean = statistics.median(seconds), statistics.fmean(seconds)
    return f"{len(seconds)} assets, median {middle:.3f}, p90 {tenths:.3f}, mean {mean:.3f} CPU-s"


if __name__ == "__main__":
    main()
