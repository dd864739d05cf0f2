"""Measure grasps on real meshes: proposals, verified grasps, causes of failure, and cost.

    python benchmarks/grasps.py MANIFEST.csv [NAME...] [--work FOLDER] [--seed N]

The manifest lists meshes like that of the shared test data (columns file, kind, category; units are metres). Every mesh passes
the stages of the pipeline up to verification. With ``--work`` the results of earlier runs are reused.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from pathlib import Path

import numpy as np

from manitwin.config import BuildConfig
from manitwin.engine.stage import Draft
from manitwin.engine.stage_runner import StageCost, run_stage
from manitwin.errors import Rejected
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.recipe import stages_for

LAST_STAGE = "verify"
FILTERS = ("raw", "after_pad", "after_collision", "after_association", "after_diversity")


def main() -> None:
    """Build the chosen meshes and print one line each, then the totals."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("manifest", type=Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--work", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    with arguments.manifest.open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["kind"] == "mesh"]
    if arguments.names:
        rows = [row for row in rows if Path(row["file"]).parent.name in arguments.names]
    verified, simulated, seconds = [], [], []
    with tempfile.TemporaryDirectory() as temporary:
        work = arguments.work or Path(temporary)
        for row in rows:
            item = Item(str(arguments.manifest.parent.resolve() / row["file"]), name=row["category"], units="m")
            held, tried, cpu_s = measure(Path(row["file"]).parent.name, item, work, arguments.seed)
            verified.append(held)
            simulated.append(tried)
            seconds.append(cpu_s)
    rate = 100 * sum(verified) / sum(simulated)
    some, many = sum(v >= 1 for v in verified), sum(v >= 20 for v in verified)
    print(f"{len(rows)} objects, {some} with a verified grasp, {many} with 20 or more")
    median, low = np.median(verified), np.percentile(verified, 10)
    print(f"verified {rate:.1f} % of the simulated, median {median:.0f}, 10th percentile {low:.0f}")
    middle, high = np.median(seconds), np.percentile(seconds, 90)
    print(f"grasps and verify: median {middle:.1f}, 90th percentile {high:.1f} CPU-s an object")


def measure(name: str, item: Item, work: Path, seed: int) -> tuple[int, int, float]:
    """Build one mesh up to its verified grasps; a rejected one counts as none verified of the full number of trials."""
    config = BuildConfig(seed=seed)
    draft = Draft(twin_id(item), item, seed)
    costs: dict[str, StageCost] = {}
    try:
        for stage in stages_for("mesh", config):
            costs[stage.name] = run_stage(stage, draft, work / draft.item_id)
            if stage.name == LAST_STAGE:
                break
    except Rejected as answer:
        print(f"{name:22s} rejected: {answer.reason}: {answer.detail}", flush=True)
        return 0, config.grasps.simulated, sum(cost.cpu_seconds for cost in costs.values())
    proposals, grasps = draft.field("proposals"), draft.field("grasps")
    cpu_s = {stage: costs[stage].cpu_seconds for stage in ("grasps", "verify")}
    filters = "/".join(str(proposals["proposed_by_filter"][name]) for name in FILTERS)
    octants = f"{proposals['approach_octants']} of {proposals['octants_available']}"
    failures = " ".join(f"{outcome} {count}" for outcome, count in grasps["failures"].items()) or "none"
    print(
        f"{name:22s} proposals {filters}, radius {grasps['association_radius_m'] * 1000:.0f} mm, "
        f"verified {grasps['verified']} of {grasps['simulated']} (failures: {failures}), "
        f"unfiltered {100 * (grasps['unfiltered_success_rate'] or 0):.0f} %, octants {octants}, "
        f"CPU-s {cpu_s['grasps']:.1f} + {cpu_s['verify']:.1f}, all {sum(c.cpu_seconds for c in costs.values()):.1f}",
        flush=True,
    )
    return grasps["verified"], grasps["simulated"], sum(cpu_s.values())


if __name__ == "__main__":
    main()
