"""Time filters on the index of a synthetic data set of 100,000 twins and 6.2 million grasps.

    python benchmarks/index.py [--twins N] [--grasps-per-twin N] [--keep FOLDER]
    python benchmarks/index.py --rows DATASET

The tables are written in parts as ``manitwin index`` leaves them. Numbers and poses are random and words are drawn from lists, so
that the data compresses no better than a real set. Every filter is timed with a new connection (including the list of parts, the
views and the lock; the files are in the operating system's cache) and again on the same connection. The columns are wall and CPU
seconds, best of five; CPU counts all threads. ``--rows`` instead times the rows of the finished twins of a real data set, once
with the shape stored in their folders and once with the shape measured from the mesh.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable, Iterator
from math import ceil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute

from manitwin.dataset.index import rows
from manitwin.dataset.index.dataset import Dataset
from manitwin.dataset.index.near_duplicates import near_duplicates
from manitwin.dataset.index.part_list import PartList
from manitwin.dataset.index.parts import PART_ROWS, write_rows
from manitwin.dataset.index.query import Index
from manitwin.dataset.index.tables import DESCRIPTOR_LENGTH, TABLES, concatenate_tables
from manitwin.twin.dataset_root import DatasetRoot

CATEGORIES = (
    "mug",
    "bowl",
    "bottle",
    "box",
    "can",
    "toy",
    "hammer",
    "plate",
    "shoe",
    *(f"thing {n}" for n in range(503)),
)
COLORS = ("red", "green", "blue", "white", "black", "brown", "grey", "yellow")
OUTCOMES = ("held", "collides", "misses", "drops", "unstable", "slips")
BAR_S = 0.2
REPEATS = 5


def words(
    rng: np.random.Generator, choices: tuple[str, ...], count: int, shares: list[float] | None = None
) -> pa.Array:
    """Return ``count`` words drawn at random from ``choices``."""
    return pa.array(choices).take(pa.array(rng.choice(len(choices), count, p=shares)))


def filled(name: str, count: int, rng: np.random.Generator, **known: pa.Array) -> pa.Table:
    """Return a table of the index with the given columns, and random values in all others according to their type."""
    columns = []
    for field in TABLES[name]:
        if field.name in known:
            columns.append(known[field.name])
        elif pa.types.is_fixed_size_list(field.type):
            values = rng.random(count * field.type.list_size)
            columns.append(pa.FixedSizeListArray.from_arrays(pa.array(values, field.type.value_type), type=field.type))
        elif pa.types.is_floating(field.type):
            columns.append(pa.array(rng.random(count)))
        elif pa.types.is_integer(field.type):
            columns.append(pa.array(rng.integers(0, 100, count), field.type))
        elif pa.types.is_boolean(field.type):
            columns.append(pa.array(rng.random(count) < 0.5))
        elif pa.types.is_list(field.type):
            columns.append(pa.nulls(count, field.type))
        else:
            columns.append(words(rng, COLORS, count))
    return pa.Table.from_arrays(columns, schema=TABLES[name])


def descriptors(count: int, rng: np.random.Generator) -> pa.Array:
    """Return descriptors that vary in four independent directions, with distances like those of real objects (about 0.1)."""
    modes = np.random.default_rng(1).normal(size=(4, DESCRIPTOR_LENGTH)) / np.sqrt(DESCRIPTOR_LENGTH)
    values = (0.5 + 0.08 * rng.normal(size=(count, 4)) @ modes).astype(np.float32)
    return pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), DESCRIPTOR_LENGTH)


def made_rows(ids: np.ndarray, per_twin: int, rng: np.random.Generator) -> dict[str, pa.Table]:
    """Return the tables of the given twins with ``per_twin`` grasps each, by name."""
    count = len(ids)
    category = words(rng, CATEGORIES, count)
    color = words(rng, COLORS, count)
    captions = [
        f"A {c} {k} made of plastic, about {n} cm long, used for tests."
        for c, k, n in zip(color.to_pylist(), category.to_pylist(), rng.integers(2, 40, count), strict=True)
    ]
    twin_of = np.repeat(np.arange(count), per_twin)
    shares = [0.75, 0.05, 0.05, 0.05, 0.05, 0.05]
    outcome = words(rng, OUTCOMES, len(twin_of), shares)
    digests = pa.array([f"{n:064x}" for n in rng.integers(0, 2**63, count)])
    numbers = np.tile(np.arange(per_twin, dtype=np.int32), count)
    twins = {
        "twin_id": pa.array(ids),
        "category": category,
        "color": color,
        "caption": pa.array(captions),
        "source_sha256": digests,
        "revision": digests,
        "config_sha256": words(rng, ("ab" * 32,), count),
        "shape_descriptor": descriptors(count, rng),
        "radius_of_gyration_m": pa.array(np.exp(rng.normal(np.log(0.05), 0.5, count))),
    }
    grasps = {
        "twin_id": pa.array(ids[twin_of]),
        "category": category.take(pa.array(twin_of)),
        "number": pa.array(numbers),
        "grasp_id": pa.array([f"panda-{n:04d}" for n in range(per_twin)]).take(pa.array(numbers)),
        "gripper": words(rng, ("panda",), len(twin_of)),
        "proposer": words(rng, ("antipodal", "antipodal:unfiltered"), len(twin_of)),
        "outcome": outcome,
        "verified": pa.compute.equal(outcome, "held"),
    }
    others = {"points": 5, "placements": 4, "stages": 15}
    return {
        "twins": filled("twins", count, rng, **twins),
        "grasps": filled("grasps", len(twin_of), rng, **grasps),
        "rejections": filled("rejections", 0, rng),
        **{n: filled(n, each * count, rng, twin_id=pa.array(np.repeat(ids, each))) for n, each in others.items()},
    }


def write_index(root: DatasetRoot, twins: int, per_twin: int) -> None:
    """Write the index of a synthetic data set."""
    rng = np.random.default_rng(0)
    ids = np.sort(np.array([f"{n:016x}" for n in rng.choice(2**62, twins, replace=False)]))
    parts = []
    for number, chunk in enumerate(np.array_split(ids, max(1, ceil(twins * per_twin / PART_ROWS)))):
        tables = {name: concatenate_tables(name, [table]) for name, table in made_rows(chunk, per_twin, rng).items()}
        parts.append(write_rows(root, number, tables))
    PartList(tuple(parts), len(parts)).write(root)


def time_rows(data: Path) -> None:
    """Print the cost of the rows of finished twins, alternating between stored and measured shapes."""
    folders = sorted(path.parent for path in data.glob("twins/*/*/grasps.parquet"))
    spent = {"as it is": 0.0, "shape measured": 0.0}
    said = rows.read_shape
    rows.rows_of(folders[0])
    for folder in folders:
        for name, read in (("as it is", said), ("shape measured", lambda folder: None)):
            rows.read_shape = read
            start = time.process_time()
            rows.rows_of(folder)
            spent[name] += time.process_time() - start
    for name, seconds in spent.items():
        print(f"rows of a twin, {name}: {1e3 * seconds / len(folders):.1f} CPU-ms (mean of {len(folders)})")


def questions(twin_id: str) -> Iterator[tuple[str, Callable[[Index], int]]]:
    """Yield filters by name; each returns the number of rows found."""
    yield (
        "twins: category = 'mug' and mass_kg < 0.4 and verified >= 20, all columns",
        lambda index: index.select("twins", "category = 'mug' and mass_kg < 0.4 and verified >= 20").num_rows,
    )
    yield (
        "twins: caption like '%red%', ids",
        lambda index: index.select("twins", "caption like '%red%'", columns=["twin_id"]).num_rows,
    )
    yield "grasps of one twin, all columns", lambda index: index.select("grasps", f"twin_id = '{twin_id}'").num_rows
    yield (
        "grasps: verified and robustness > 0.8 of mugs, all columns",
        lambda index: index.select("grasps", "category = 'mug' and verified and robustness > 0.8").num_rows,
    )
    yield (
        "twins: verified >= 20 and mass_kg < 0.4, ids",
        lambda index: index.select("twins", "verified >= 20 and mass_kg < 0.4", columns=["twin_id"]).num_rows,
    )
    red_mugs = "category = 'mug' and color = 'red' and mass_kg < 0.4"
    poses = ["twin_id", "position_m", "quaternion_wxyz"]
    yield (
        "verified grasps of red mugs under 0.4 kg by Dataset.grasps, poses",
        lambda index: Dataset(index.root, _index=index).filter(red_mugs).grasps("verified", poses).num_rows,
    )
    owners = f"verified and twin_id in (select twin_id from twins where {red_mugs})"
    yield "the same by a subquery, poses", lambda index: index.select("grasps", owners, columns=poses).num_rows
    yield (
        "grasps: verified and robustness > 0.8 of all, count",
        lambda index: index.count("grasps", "verified and robustness > 0.8"),
    )
    yield (
        "grasps: outcomes by category, counted",
        lambda index: len(
            index.connection.sql("SELECT category, outcome, count(*) FROM grasps GROUP BY ALL").fetchall()
        ),
    )
    yield "points: label = 'red', all columns", lambda index: index.select("points", "label = 'red'").num_rows


def timed(action: Callable[[], int]) -> tuple[float, float, int]:
    """Return the wall and CPU seconds of the fastest run, and its result."""
    best = (np.inf, np.inf, 0)
    for _ in range(REPEATS):
        wall, cpu = time.perf_counter(), time.process_time()
        answer = action()
        best = min(best, (time.perf_counter() - wall, time.process_time() - cpu, answer))
    return best


def main() -> None:
    """Print one row per filter, and the size of the index on disk."""
    parser = argparse.ArgumentParser(description="Filters on a large index.")
    parser.add_argument("--twins", type=int, default=100_000)
    parser.add_argument("--grasps-per-twin", type=int, default=62)
    parser.add_argument("--keep", type=Path, default=None, help="Write the index here, or use the one that is here.")
    parser.add_argument("--rows", type=Path)
    arguments = parser.parse_args()
    if arguments.rows is not None:
        time_rows(arguments.rows)
        return
    with tempfile.TemporaryDirectory() as scratch:
        root = DatasetRoot(arguments.keep or scratch)
        if not root.exists("index/parts.json"):
            start = time.process_time()
            write_index(root, arguments.twins, arguments.grasps_per_twin)
            print(f"written in {time.process_time() - start:.1f} CPU-s")
        parts = Index(root).parts
        size = sum(root.fs.size(root.full(name)) for name in root.names_below("index"))
        print(
            f"{parts.rows('twins')} twins, {parts.rows('grasps')} grasps, {len(parts.parts)} parts, {size / 1e6:.0f} MB\n"
        )
        twin_id = Index(root).select("twins", columns=["twin_id"], limit=1000)["twin_id"][-1].as_py()
        print("| filter | rows | fresh: wall s | CPU s | again: wall s | CPU s |\n|---|---|---|---|---|---|")
        slow = []
        for name, ask in questions(twin_id):
            fresh = timed(lambda ask=ask: ask(Index(root)))
            index = Index(root)
            again = timed(lambda ask=ask, index=index: ask(index))
            print(
                f"| {name} | {fresh[2]} | {fresh[0]:.3f} | {fresh[1]:.3f} | {again[0]:.3f} | {again[1]:.3f} |",
                flush=True,
            )
            slow += [name] if max(fresh[0], again[0]) > BAR_S else []
        start = time.process_time()
        found = near_duplicates(Index(root))
        print(f"\nnear-duplicates: {len(found.pairs)} pairs in {time.process_time() - start:.1f} CPU-s")
        print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.1f} GB")
        print(f"over {BAR_S} s: {', '.join(slow) or 'none'}")


if __name__ == "__main__":
    main()
