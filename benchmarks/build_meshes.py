"""Build a twin of every mesh of a data folder, and print the results and their cost.

    python benchmarks/build_meshes.py DATA OUT [--jobs N] [--only NAME,NAME] [--quick] [--sample]

DATA holds ``manifest.csv`` with the columns file, kind and category. Meshes are taken to be in metres and are named by their
category. Objects without a twin or without a grasp count as 0 of 100. CPU seconds are those of the worker by stage, from
run.json. Workers are forked like those of the command line if NumPy uses one thread (OPENBLAS_NUM_THREADS=1), and spawned
otherwise.
"""

from __future__ import annotations

import argparse
import csv
import json
import resource
from pathlib import Path

import numpy as np

import manitwin
from manitwin.cli.commands.build import OF_WORKERS
from manitwin.cli.run_summary import grasp_lines, summarize_grasps
from manitwin.engine.fork_server import forked_workers
from manitwin.twin.store import read_record

GRASPS_WANTED = 100


def write_manifest(data: Path, out: Path, kind: str, only: set[str]) -> Path:
    """Write a manifest of the meshes or photos of the data folder, named by category, and return its path."""
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"{kind}.csv"
    with (data / "manifest.csv").open(newline="") as source, path.open("w", newline="") as target:
        writer = csv.writer(target)
        writer.writerow(["file", "name", "units"])
        for row in csv.DictReader(source):
            if row["kind"] == kind and (not only or label(Path(row["file"]), kind) in only):
                writer.writerow([(data / row["file"]).resolve(), row["category"], "m" if kind == "mesh" else "auto"])
    return path


def label(file: Path, kind: str) -> str:
    """Return the short name of an input: the folder's name for a mesh, the file's stem for a photo."""
    return file.parent.name if kind == "mesh" else file.stem


HEADER = f"{'object':22s} {'status':9s} {'prop':>5s} {'sim':>4s} {'ver':>4s} {'unf %':>6s} {'oct':>4s} {'r cm':>5s} {'CPU s':>6s}"


def print_table(results: list, kind: str) -> list[dict]:
    """Print a row for each result, and return the figures of the rows."""
    print(f"{HEADER}  failures or reason")
    figures = []
    for result in sorted(results, key=lambda r: r.item.file):
        name = f"{label(Path(result.item.file), kind):22s} {result.status:9s}"
        run = json.loads((result.folder / "run.json").read_text()) if result.folder else {"stages": {}}
        cpu = {stage: cost["cpu_seconds"] for stage, cost in run["stages"].items()}
        grasps = read_record(result.folder).grasps if result.folder else None
        if grasps is None:
            print(f"{name} {'':32s} {sum(cpu.values()):6.1f}  {result.detail}")
            figures.append({"verified": 0, "simulated": 0, "cpu": cpu, "accepted": False, "octants": 0})
            continue
        unfiltered = 100 * (grasps.unfiltered_success_rate or 0.0)
        failures = ", ".join(f"{count} {outcome}" for outcome, count in grasps.failures.items())
        print(
            f"{name} {grasps.proposed:5d} {grasps.simulated:4d} {grasps.verified:4d} {unfiltered:6.0f}"
            f" {grasps.approach_octants:4d}"
            f" {100 * grasps.association_radius_m:5.1f} {sum(cpu.values()):6.1f}  {failures}"
        )
        row = {"verified": grasps.verified, "simulated": grasps.simulated, "octants": grasps.approach_octants}
        figures.append({**row, "cpu": cpu, "accepted": True})
    return figures


def print_summary(figures: list[dict]) -> None:
    """Print the figures over all objects, and CPU seconds by stage."""
    verified = np.array([f["verified"] for f in figures])
    simulated = np.array([max(f["simulated"], 0 if f["verified"] else GRASPS_WANTED) for f in figures])
    accepted = sum(f["accepted"] for f in figures)
    many, wide = int(np.sum(verified >= 20)), sum(f["octants"] >= 4 for f in figures)
    rate = 100 * verified.sum() / max(simulated.sum(), 1)
    print(
        f"\naccepted {accepted}/{len(figures)}, {many} with 20 verified or more, {wide} with 4 approach octants or more"
    )
    print(
        f"verified {verified.sum()}/{simulated.sum()} = {rate:.1f} % of the simulated (none held counts 0 of {GRASPS_WANTED})"
    )
    print(f"verified per object: median {np.median(verified):.0f}, 10th percentile {np.percentile(verified, 10):.0f}")
    for stage in dict.fromkeys(stage for f in figures for stage in f["cpu"]):
        print_seconds(stage, [f["cpu"][stage] for f in figures if stage in f["cpu"]])
    print_seconds("whole chain", [sum(f["cpu"].values()) for f in figures if f["cpu"]])
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"peak memory of a worker {peak:.0f} MB")


def print_seconds(name: str, seconds: list[float]) -> None:
    """Print the median, 90th percentile and maximum of CPU seconds."""
    ninetieth = np.percentile(seconds, 90)
    print(f"  {name:14s} median {np.median(seconds):6.2f}  p90 {ninetieth:6.2f}  max {max(seconds):6.2f} CPU-s")


def main() -> None:
    """Build the twins and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--kind", choices=["mesh", "photo"], default="mesh")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--quick", action="store_true", help="without second engine and robustness")
    parser.add_argument("--sample", action="store_true", help="the second engine tries a sample of what held")
    arguments = parser.parse_args()
    only = set(filter(None, arguments.only.split(",")))
    manifest = write_manifest(arguments.data, arguments.out, arguments.kind, only)
    with forked_workers(OF_WORKERS):
        report = manitwin.build(
            manifest,
            arguments.out / "twins",
            jobs=arguments.jobs,
            quick=arguments.quick,
            second_opinion="sample" if arguments.sample else None,
            on_result=lambda r: print(".", end="", flush=True),
        )
    print()
    print_summary(print_table(report.results, arguments.kind))
    print(*grasp_lines(summarize_grasps(report.records())), sep="\n")


if __name__ == "__main__":
    main()
