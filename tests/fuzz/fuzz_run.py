"""Fuzz readers by hand: ``.venv/bin/python tests/fuzz/fuzz_run.py [TARGET ...] [--count N] [--first N] [--seed N] [--shared]``.

Prints how the cases of each target ended, and the failures with the command that repeats them. ``--seed N`` reads the one case
and prints its traceback; ``--keep FOLDER`` copies its mutated file there. Exit status 1 where something failed.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

from fuzz_harness import all_targets, fuzz
from fuzz_worker import Worker

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("targets", nargs="*")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--shared", action="store_true")
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--quiet", action="store_true")
    given = parser.parse_args()
    targets = all_targets()
    unknown = set(given.targets) - set(targets)
    if unknown:
        sys.exit(f"unknown: {', '.join(sorted(unknown))}; valid: {', '.join(targets)}")
    shared = SHARED if given.shared else None
    failed = False
    for name in given.targets or targets:
        if given.keep is not None:
            keep(name, given.seed, given.keep, shared)
        first, count = (given.seed, 1) if given.seed is not None else (given.first, given.count)
        try:
            run = fuzz(targets[name], max(1, int(count * targets[name].weight)), first=first, shared=shared)
        except AssertionError as error:  # its samples are not read
            failed = True
            print(f"{name}: {error}", flush=True)
            continue
        told = ", ".join(f"{kind} {number}" for kind, number in run.outcomes.most_common())
        print(f"{name}: {run.seconds:.1f} s: {told}", flush=True)
        for outcome, message in {} if given.quiet else run.messages.items():
            if outcome != "read":
                print(f"    {outcome}: {message}")
        for warning in {each.where: each for each in run.warnings}.values():
            print(f"    {warning}")
        if run.failures:
            failed = True
            print(run.report(), flush=True)
            if given.seed is not None:
                print(run.failures[0].traceback)
    sys.exit(1 if failed else 0)


def keep(name: str, case: int, folder: Path, shared: Path | None) -> None:
    """Copy all files of a case to a folder."""
    target = all_targets()[name]
    with tempfile.TemporaryDirectory() as temporary:
        (Path(temporary) / "samples").mkdir()
        target.make(Path(temporary) / "samples")
        worker = Worker(target, 60, Path(temporary), shared)
        shutil.rmtree(folder, ignore_errors=True)
        worker._read = lambda name: print(f"kept {shutil.copytree(worker.place, folder, symlinks=True)}/{name}") or {}  # type: ignore
        worker.run(case)


if __name__ == "__main__":
    main()
