"""Build the meshes of a data folder with two checkouts of the code at once, and print the costs of each stage side by side.

    python benchmarks/side_by_side.py OTHER DATA OUT [--only NAME,NAME] [--full] [--sample]

``OTHER`` is a checkout of the code to compare with (``git worktree add OTHER COMMIT``); DATA is as for ``build_meshes.py``. Both
builds run at the same time, one process each, so that other load on the machine affects both alike; the ratio is what matters.
CPU seconds are those of the stages from run.json. Printed are medians over the objects, and of their ratios.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from build_meshes import write_manifest

from manitwin.pipeline.stage_order import place_in_pipeline
from manitwin.twin.store import read_record

HERE = Path(__file__).resolve().parent.parent
BUILD = """
import sys, manitwin
flags = {"second_opinion": "sample"} if sys.argv[4] == "sample" else {}
manitwin.build(sys.argv[1], sys.argv[2], executor="inline", quick=sys.argv[3] == "quick", **flags)
"""
CHAIN = "whole chain"


def main() -> None:
    """Build with both checkouts and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("other", type=Path)
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--full", action="store_true", help="with second engine and robustness")
    parser.add_argument("--sample", action="store_true", help="the second engine tries a sample here, and all there")
    arguments = parser.parse_args()
    manifest = write_manifest(arguments.data, arguments.out, "mesh", set(filter(None, arguments.only.split(","))))
    environment = {"OMP_NUM_THREADS": "1", "LP_NUM_THREADS": "0"}  # as in workers
    running = []
    for name, checkout in (("other", arguments.other), ("this", HERE)):
        paths = {"PYTHONPATH": str(checkout / "src")}
        sampled = "sample" if arguments.sample and name == "this" else "all"
        amount = "full" if arguments.full else "quick"
        command = [sys.executable, "-c", BUILD, manifest, arguments.out / name, amount, sampled]
        running.append(subprocess.Popen(command, env={**os.environ, **environment, **paths}))
    if max([build.wait() for build in running]):
        sys.exit("a build failed")
    print_table(*(costs_of(arguments.out / name) for name in ("other", "this")))


def costs_of(data: Path) -> dict[str, dict[str, float]]:
    """Return CPU seconds by stage and in total, size in megabytes, and grasp counts of each twin, by twin id."""
    found = {}
    for path in sorted(data.glob("twins/*/*/run.json")):
        stages = {name: cost["cpu_seconds"] for name, cost in json.loads(path.read_text())["stages"].items()}
        grasps = read_record(path.parent).grasps
        tried = {"simulated": grasps.simulated, "verified": grasps.verified} if grasps is not None else {}
        size = sum(file.stat().st_size for file in path.parent.rglob("*") if file.is_file())
        found[path.parent.name] = {**stages, CHAIN: sum(stages.values()), "megabytes": size / 1e6, **tried}
    return found


def print_table(other: dict[str, dict[str, float]], this: dict[str, dict[str, float]]) -> None:
    """Print medians and 90th percentiles over the twins that both have, and the median of their ratios."""
    both = sorted(set(other) & set(this))
    stages = sorted(
        {name for twin in both for name in other[twin] if name in this[twin]} - {CHAIN}, key=place_in_pipeline
    )
    print(f"{len(both)} twins\n{'':14s} {'other':>8s} {'this':>8s} {'ratio':>6s} {'p90':>8s} {'this':>8s}")
    for name in (*stages, CHAIN):
        pairs = np.array(
            [(other[twin][name], this[twin][name]) for twin in both if name in other[twin] and name in this[twin]]
        )
        (before, after), (high, now) = np.median(pairs, axis=0), np.percentile(pairs, 90, axis=0)
        ratio = np.median(pairs[:, 1] / np.maximum(pairs[:, 0], 1e-9))
        print(f"{name:14s} {before:8.2f} {after:8.2f} {ratio:6.2f} {high:8.2f} {now:8.2f}")


if __name__ == "__main__":
    main()
