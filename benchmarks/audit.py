"""Measure how long an audit of 1,000 assets takes: copies of a few twins, and copies of them in other formats.

python benchmarks/audit.py DATASET                     every twin below, copied until there are 1,000 assets
python benchmarks/audit.py DATASET --formats urdf,mjcf,robotwin     half of them exported to these formats

Writes the copies to a temporary folder. Prints CPU seconds (child processes included), wall time and the findings.
"""

from __future__ import annotations

import argparse
import itertools
import resource
import shutil
import tempfile
import time
from collections import Counter
from importlib import import_module
from pathlib import Path

from manitwin.assets.audit.run import audit_all, find_all, rules_selected
from manitwin.assets.writers.exporter import TwinContent
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD

TWINS = 8
"""Number of different twins that are copied."""


def write_assets(dataset: Path, out: Path, count: int, formats: list[str]) -> None:
    """Copy twins into ``out``, every second one as a twin and the others in the given formats in turn."""
    twins = sorted(path.parent for path in dataset.rglob(RECORD) if ".work" not in path.parts)
    accepted = [folder for folder in twins if Twin(folder).record.status == "accepted"][:TWINS]
    if not accepted:
        raise SystemExit(f"{dataset}: no accepted twin")
    contents = [TwinContent.of(Twin(folder)) for folder in accepted] if formats else []
    exported = {
        (format, index): import_module(f"manitwin.assets.writers.{format}").export(content).files
        for format in formats
        for index, content in enumerate(contents)
    }
    kinds = itertools.cycle([kind for format in formats for kind in ("twin", format)] or ["twin"])
    for number, kind in zip(range(count), kinds, strict=False):
        folder = out / f"{number:04d}_{kind}"
        if kind == "twin":
            shutil.copytree(accepted[number % len(accepted)], folder)
            continue
        for name, data in exported[kind, number % len(accepted)].items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)


def cpu_seconds() -> float:
    """Return the CPU seconds of this process and of its child processes that have ended."""
    use = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in use)


def main() -> None:
    """Write the assets, audit them and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--formats", default="", help="export formats for every second asset, with commas")
    arguments = parser.parse_args()
    formats = [name for name in arguments.formats.split(",") if name]
    with tempfile.TemporaryDirectory() as temporary:
        write_assets(arguments.dataset, Path(temporary), arguments.count, formats)
        cpu, wall = cpu_seconds(), time.perf_counter()
        paths = find_all([Path(temporary)])
        audited = list(audit_all(paths, rules_selected(), jobs=arguments.jobs))
        cpu, wall = cpu_seconds() - cpu, time.perf_counter() - wall
    by_format = Counter(each.format or "unreadable" for each in audited)
    found = Counter(finding.code for each in audited for finding in each.findings)
    print(f"{len(audited)} assets ({', '.join(f'{n} {f}' for f, n in sorted(by_format.items()))})")
    print(
        f"{cpu:.1f} CPU s, {wall:.1f} s with {arguments.jobs} processes, {1000 * cpu / len(audited):.0f} CPU ms an asset"
    )
    print(", ".join(f"{code} {count}" for code, count in sorted(found.items())) or "no findings")


if __name__ == "__main__":
    main()
