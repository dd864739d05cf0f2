"""An index of made-up twins, as large as asked for: what its numbers should be is known from how they were drawn."""

from __future__ import annotations

import hashlib

import numpy as np
import pyarrow as pa

from manitwin.dataset.index.tables import DESCRIPTOR_LENGTH, TABLES, concatenate_tables
from manitwin.twin.record import REJECTION_REASONS

CATEGORIES = ("mug", "bottle", "hammer", "spoon", "box", "banana", "stapler", "toy", "bowl", "screwdriver")
COLORS = ("red", "dark grey (61 %), black (12 %)", "light blue", "white", "unknown color (untextured)")
MATERIALS = ("plastic", "steel", "wood and steel", "ceramic", "glass, metal")
SHAPES = ("cylindrical", "box-shaped", "long and thin", "round and shallow")
FUNCTIONS = ("holding hot drinks", "driving nails", "eating", "keeping things together", "playing")
SIZES = ("palm-sized", "hand-sized", "medium-sized", "large")
OUTCOMES = ("held", "collides", "unreachable", "misses", "penetrates", "drops", "unstable", "slips")
TYPES = ("parallel_jaw", "pinch", "power")
STAGES = (
    "mesh",
    "views",
    "gate",
    "physical",
    "collision",
    "caption",
    "candidates",
    "points",
    "grasps",
    "verify",
    "finish",
)


def identities(count: int, salt: str) -> list[str]:
    """Return ids like those of twins."""
    return [hashlib.sha256(f"{salt}{number}".encode()).hexdigest()[:16] for number in range(count)]


def _strings(choices: tuple[str, ...], picks: np.ndarray) -> pa.Array:
    return pa.DictionaryArray.from_arrays(pa.array(picks.astype(np.int32)), pa.array(choices)).cast(pa.string())


def twins_table(count: int, rng: np.random.Generator, category_names: tuple[str, ...] = CATEGORIES) -> pa.Table:
    """Return accepted twins; of every tenth one neither robustness nor a second engine was tried."""
    shares = 1.0 / np.arange(1, len(category_names) + 1)
    category = rng.choice(len(category_names), count, p=shares / shares.sum())
    longest = np.exp(rng.normal(np.log(0.15), 0.5, count)).clip(0.02, 0.9)
    mass = np.exp(rng.normal(np.log(0.2), 0.9, count)).clip(0.003, 8)
    simulated = rng.integers(20, 101, count)
    verified = rng.binomial(simulated, rng.beta(8, 2, count)).clip(1)
    judged = rng.random(count) < 0.9
    sizes = [
        f"{100 * side:.0f} cm, {SIZES[pick]}" for side, pick in zip(longest, rng.integers(0, 4, count), strict=True)
    ]
    columns = {
        "twin_id": identities(count, "twin"),
        "name": _strings(category_names, category),
        "kind": _strings(("image", "text", "mesh"), rng.choice(3, count, p=[0.5, 0.1, 0.4])),
        "source_sha256": identities(count, "source"),
        "license": _strings(("CC-BY-4.0", "unknown", "CC0-1.0"), rng.integers(0, 3, count)),
        "attribution": _strings(("A. Maker", "B. Maker"), rng.integers(0, 2, count)),
        "category": _strings(category_names, category),
        "color": _strings(COLORS, rng.integers(0, len(COLORS), count)),
        "material": _strings(MATERIALS, rng.integers(0, len(MATERIALS), count)),
        "size": sizes,
        "shape": _strings(SHAPES, rng.integers(0, len(SHAPES), count)),
        "function": _strings(FUNCTIONS, rng.integers(0, len(FUNCTIONS), count)),
        "mass_kg": mass,
        "mass_low_kg": mass * 0.5,
        "mass_high_kg": mass * 2,
        "mass_source": _strings(("prior:mug", "density*volume", "measured"), rng.integers(0, 3, count)),
        "friction_static": rng.uniform(0.2, 0.8, count),
        "density_kg_m3": rng.uniform(200, 3000, count),
        "extent_z_m": longest * rng.uniform(0.2, 1, count),
        "longest_m": longest,
        "volume_m3": mass / rng.uniform(300, 2000, count),
        "hulls": rng.integers(1, 33, count),
        "gripper": ["panda"] * count,
        "proposed": simulated * 5,
        "simulated": simulated,
        "verified": verified,
        "success_rate": verified / simulated,
        "unfiltered_simulated": np.full(count, 20),
        "unfiltered_success_rate": rng.integers(0, 21, count) / 20,
        "approach_octants": rng.integers(1, 9, count),
        "robust": pa.array((verified * 0.9).astype(int), mask=~judged),
        "robustness_median": pa.array(rng.uniform(0.5, 1, count), mask=~judged),
        "functional_points": rng.integers(2, 5, count),
        "grasp_points": rng.integers(2, 4, count),
        "placements": rng.integers(1, 5, count),
        "upright_probability": rng.random(count),
        "failed_checks": [["category_known"] if pick else [] for pick in rng.random(count) < 0.2],
        "seed": np.zeros(count, int),
        "config_sha256": ["c0ffee" * 10] * count,
        "radius_of_gyration_m": longest / 3,
        "shape_descriptor": pa.FixedSizeListArray.from_arrays(
            rng.random(count * DESCRIPTOR_LENGTH, np.float32), DESCRIPTOR_LENGTH
        ),
    }
    return pa.table(columns)


def rejections_table(count: int, rng: np.random.Generator) -> pa.Table:
    """Return rejected items of all stages and reasons."""
    reasons = [(stage, reason) for stage, known in REJECTION_REASONS.items() for reason in sorted(known)]
    picks = rng.integers(0, len(reasons), count)
    stages = [reasons[pick][0] for pick in picks]
    kinds = [
        "image" if stage == "generate" else ("image", "mesh")[pick % 2]
        for stage, pick in zip(stages, picks, strict=True)
    ]
    return pa.table(
        {
            "twin_id": identities(count, "rejected"),
            "kind": pa.array(kinds, pa.string()),
            "source_sha256": identities(count, "rejected source"),
            "license": pa.array(["unknown"] * count, pa.string()),
            "stage": pa.array(stages, pa.string()),
            "reason": pa.array([reasons[pick][1] for pick in picks], pa.string()),
            "seed": np.zeros(count, int),
            "config_sha256": pa.array(["c0ffee" * 10] * count, pa.string()),
        }
    )


def points_table(twins: pa.Table, rng: np.random.Generator) -> pa.Table:
    """Return two functional points and two grasp points a twin, ids f0 f1 g0 g1."""
    ids = np.repeat(twins["twin_id"].to_numpy(zero_copy_only=False), 4)
    count = len(ids)
    functional = np.arange(count) % 4 < 2
    return pa.table(
        {
            "twin_id": ids,
            "point_id": _strings(("f0", "f1", "g0", "g1"), np.arange(count) % 4),
            "role": _strings(("grasp", "functional"), functional.astype(int)),
            "label": pa.array(_strings(("handle", "base", "opening"), rng.integers(0, 3, count)), mask=~functional),
            "type": pa.array(_strings(TYPES, rng.integers(0, 3, count)), mask=functional),
        }
    )


def grasps_table(twins: pa.Table, rng: np.random.Generator) -> pa.Table:
    """Return each twin's grasps as its row counts them, 20 unfiltered ones and 2 jittered controls."""
    simulated, verified = twins["simulated"].to_numpy(), twins["verified"].to_numpy()
    each = simulated + 22
    owner = np.repeat(np.arange(len(twins)), each)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(each) - each, each)
    own, control = number < simulated[owner], number >= simulated[owner] + 20
    outcome = rng.integers(1, len(OUTCOMES), len(owner))
    outcome[own & (number < verified[owner])] = 0
    held_of_sample = np.rint(twins["unfiltered_success_rate"].to_numpy() * 20)[owner]
    outcome[~own & ~control & (number - simulated[owner] < held_of_sample)] = 0
    outcome[control & (rng.random(len(owner)) < 0.5)] = 0
    held = outcome == 0
    second = np.where(rng.random(len(owner)) < 0.9, held, ~held)
    kinds = np.where(own, 0, np.where(control, 2, 1))
    ids = pa.DictionaryArray.from_arrays(pa.array(owner.astype(np.int32)), twins["twin_id"].combine_chunks())
    return pa.table(
        {
            "twin_id": ids.cast(pa.string()),
            "gripper": _strings(("panda",), np.zeros(len(owner))),
            "proposer": _strings(("antipodal", "antipodal:unfiltered", "antipodal:jittered"), kinds),
            "grasp_point_id": _strings(("g0", "g1"), number % 2),
            "outcome": _strings(OUTCOMES, outcome),
            "verified": held & own,
            "holds_in_second_engine": pa.array(second, mask=kinds == 1),
            "robustness": pa.array(rng.integers(0, 11, len(owner)) / 10, mask=~(held & own)),
            "retired": np.zeros(len(owner), bool),
        }
    )


def placements_table(twins: pa.Table, rng: np.random.Generator) -> pa.Table:
    """Return the placements that each twin's row counts."""
    each = twins["placements"].to_numpy()
    ids = np.repeat(twins["twin_id"].to_numpy(zero_copy_only=False), each)
    return pa.table(
        {
            "twin_id": pa.array(ids, pa.string()),
            "upright": rng.random(len(ids)) < 0.3,
            "settled": rng.random(len(ids)) < 0.95,
            "collision_radius_m": rng.uniform(0.02, 0.3, len(ids)),
        }
    )


def stages_table(twins: pa.Table, rng: np.random.Generator) -> pa.Table:
    """Return one row a stage of every accepted twin."""
    count, stages = len(twins), len(STAGES)
    position = np.tile(np.arange(stages), count)
    cpu = rng.exponential(0.1 * (1 + position))
    return pa.table(
        {
            "twin_id": pa.array(np.repeat(twins["twin_id"].to_numpy(zero_copy_only=False), stages), pa.string()),
            "position": position,
            "stage": _strings(STAGES, position),
            "version": _strings(("1",), np.zeros(len(position))),
            "backend": _strings(("builtin",), np.zeros(len(position))),
            "model": pa.nulls(len(position), pa.string()),
            "seconds": cpu * 1.5,
            "cpu_seconds": cpu,
            "cost_usd": np.where(position == 5, 0.001, 0.0),
        }
    )


def synthetic_tables(
    accepted: int, rejected: int, seed: int = 0, category_names: tuple[str, ...] = CATEGORIES
) -> dict[str, pa.Table]:
    """Return all six tables of an index."""
    rng = np.random.default_rng(seed)
    twins = twins_table(accepted, rng, category_names)
    made = {
        "twins": twins,
        "points": points_table(twins, rng),
        "grasps": grasps_table(twins, rng),
        "placements": placements_table(twins, rng),
        "rejections": rejections_table(rejected, rng),
        "stages": stages_table(twins, rng),
    }
    return {name: _whole(name, table) for name, table in made.items()}


def _whole(name: str, table: pa.Table) -> pa.Table:
    """Return a table with all columns of the index, in its order: NULL in those that no statistics look at."""
    schema = TABLES[name]
    columns = [table[f.name] if f.name in table.column_names else pa.nulls(len(table), f.type) for f in schema]
    return concatenate_tables(name, [pa.table(columns, names=schema.names).cast(schema)])
