"""The six tables of an index: columns, row order and Parquet encoding.

SI units, object frame, quaternions wxyz. Every twin is in exactly one of ``twins`` (accepted) and ``rejections``, and has rows in
the other tables, keyed by ``twin_id``. ``grasps`` repeats the ``category`` of its twin, so that queries such as all grasps of
mugs need no join; the column compresses to almost nothing.

This module imports neither mesh nor simulation code, so that queries start quickly.
"""

from __future__ import annotations

import hashlib
import io

import pyarrow as pa
import pyarrow.parquet as pq

_TEXT, _REAL, _COUNT, _FLAG = pa.string(), pa.float64(), pa.int32(), pa.bool_()


def _schema(**columns: pa.DataType) -> pa.Schema:
    return pa.schema(list(columns.items()))


def _columns_of_type(kind: pa.DataType, names: str) -> dict[str, pa.DataType]:
    return dict.fromkeys(names.split(), kind)


_COST = _columns_of_type(_REAL, "seconds cpu_seconds cost_usd")
_ORIGIN = _columns_of_type(_TEXT, "twin_id revision name kind source_sha256 license")

DESCRIPTOR_LENGTH = 66
"""Length of ``geometry.shape_descriptor``."""

TABLES: dict[str, pa.Schema] = {
    "twins": _schema(
        **_ORIGIN,
        **_columns_of_type(_TEXT, "attribution category color material size shape function caption"),
        physical_material=_TEXT,
        **_columns_of_type(_REAL, "mass_kg mass_low_kg mass_high_kg"),
        mass_source=_TEXT,
        **_columns_of_type(_REAL, "friction_static friction_dynamic density_kg_m3"),
        **_columns_of_type(_REAL, "extent_x_m extent_y_m extent_z_m longest_m radius_of_gyration_m volume_m3 area_m2"),
        watertight=_FLAG,
        hulls=_COUNT,
        keeps_opening=_FLAG,
        gripper=_TEXT,
        **_columns_of_type(_COUNT, "proposed simulated verified"),
        success_rate=_REAL,
        unfiltered_simulated=_COUNT,
        unfiltered_success_rate=_REAL,
        **_columns_of_type(_COUNT, "approach_octants robust"),
        **_columns_of_type(_REAL, "robustness_median held_in_second_engine_share kappa"),
        **_columns_of_type(_COUNT, "functional_points grasp_points placements"),
        upright_probability=_REAL,
        failed_checks=pa.list_(_TEXT),
        seed=pa.int64(),
        config_sha256=_TEXT,
        **_COST,
        shape_descriptor=pa.list_(pa.float32(), DESCRIPTOR_LENGTH),
    ),
    "points": _schema(
        **_columns_of_type(_TEXT, "twin_id point_id role"),
        candidate=_COUNT,
        **_columns_of_type(_REAL, "x_m y_m z_m normal_x normal_y normal_z"),
        **_columns_of_type(_TEXT, "label description type scenario"),
        confidence=_REAL,
    ),
    "grasps": _schema(
        **_columns_of_type(_TEXT, "twin_id category"),
        number=_COUNT,
        # From here on the columns are those of a twin's grasps.parquet.
        **_columns_of_type(_TEXT, "grasp_id gripper"),
        position_m=pa.list_(_REAL, 3),
        quaternion_wxyz=pa.list_(_REAL, 4),
        **_columns_of_type(_REAL, "width_m depth_m score"),
        **_columns_of_type(_TEXT, "proposer grasp_point_id functional_point_id part_id"),
        distance_to_point_m=_REAL,
        outcome=_TEXT,
        verified=_FLAG,
        **_columns_of_type(_REAL, "displacement_m rotation_rad"),
        holds_in_second_engine=_FLAG,
        robustness=_REAL,
        robustness_trials=_COUNT,
        retired=_FLAG,
        **_columns_of_type(pa.list_(_REAL), "pregrasp_joints_rad grasp_joints_rad"),
    ),
    "placements": _schema(
        twin_id=_TEXT,
        number=_COUNT,
        **_columns_of_type(_REAL, "x_m y_m z_m"),
        quaternion_wxyz=pa.list_(_REAL, 4),
        probability=_REAL,
        **_columns_of_type(_FLAG, "upright settled"),
        collision_radius_m=_REAL,
    ),
    "rejections": _schema(
        **_ORIGIN, **_columns_of_type(_TEXT, "stage reason detail"), **_COST, config_sha256=_TEXT, seed=pa.int64()
    ),
    "stages": _schema(
        **_columns_of_type(_TEXT, "twin_id status"),
        position=_COUNT,
        **_columns_of_type(_TEXT, "stage version backend model"),
        **_COST,
    ),
}

ORDER: dict[str, tuple[str, ...]] = {
    "twins": ("twin_id",),
    "points": ("twin_id", "role", "point_id"),
    "grasps": ("twin_id", "number"),
    "placements": ("twin_id", "number"),
    "rejections": ("twin_id",),
    "stages": ("twin_id", "position"),
}
"""Sort order of query results, unique per row."""

_IN_FILES = {**ORDER, "grasps": ("category", *ORDER["grasps"])}
"""Sort order in files. Rows of a category are contiguous: a query for all grasps of mugs reads one row group in 60 instead of all
(0.06 s instead of 0.5 s). The rows of a single twin are still found by the id ranges of parts and row groups (0.03 s).
"""

_ROW_GROUP = 1 << 16
"""Rows per row group; half or twice as many are equally fast (benchmarks/index.py)."""

_UNLIKE = ("twin_id", "revision", "source_sha256", "caption")
"""Text columns of ``twins`` whose values are unique per row, where dictionary encoding only adds cost."""

SCHEMA_ID = hashlib.sha256(
    repr([(n, [(f.name, str(f.type)) for f in s]) for n, s in TABLES.items()]).encode()
).hexdigest()
"""Changes with any table, column name or type. Parts with another id are not read but rewritten."""


def parquet(table: pa.Table) -> bytes:
    """Return a table of the index as a Parquet file; equal tables give equal bytes.

    Tables are compressed with zstd, except ``twins``, which uses lz4: it is small and wide, queries read a few of its rows out of
    all row groups, and lz4 takes half the time (0.07 instead of 0.14 CPU-s for 100,000 twins, 54 instead of 45 MB).
    """
    twins = table.schema == TABLES["twins"]
    words = [field.name for field in table.schema if field.type == _TEXT and not (twins and field.name in _UNLIKE)]
    codec = "lz4" if twins else "zstd"
    stream = io.BytesIO()
    pq.write_table(table, stream, compression=codec, use_dictionary=words, row_group_size=_ROW_GROUP, version="2.6")
    return stream.getvalue()


def concatenate_tables(name: str, tables: list[pa.Table]) -> pa.Table:
    """Return the concatenated rows of one table in file order."""
    rows = pa.concat_tables([TABLES[name].empty_table(), *tables])
    return rows.sort_by([(column, "ascending") for column in _IN_FILES[name]]).combine_chunks()
