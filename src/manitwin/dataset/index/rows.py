"""Rows of the index tables from a twin's folder."""

from __future__ import annotations

import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from manitwin.dataset.index.tables import TABLES
from manitwin.engine.stage_runner import StageCost
from manitwin.errors import AssetError, TwinError
from manitwin.formats.json_file import json_number, read_json_object
from manitwin.geometry.shape_descriptor import ShapeDescriptor
from manitwin.pipeline.stage_order import place_in_pipeline
from manitwin.twin.grasp_summary import GraspSummary
from manitwin.twin.grasp_table import read_grasp_table
from manitwin.twin.point_records import Points
from manitwin.twin.record import TwinRecord
from manitwin.twin.shape_file import SHAPE, compute_shape, read_shape
from manitwin.twin.store import RECORD, REMEDY, RUN, read_record

VISUAL, GRASPS = "visual.glb", "grasps.parquet"
FILES = (RECORD, RUN, SHAPE, VISUAL, GRASPS)
"""All files read from a twin's folder. A rejected twin has only the first two. The mesh is read only if the shape file is
missing.
"""

_Row = dict[str, Any]


def rows_of(folder: Path) -> dict[str, pa.Table]:
    """Return the rows of a twin by table: one row in ``twins`` or ``rejections``, and the rows of the other tables.

    Equal files give equal rows. Raises TwinError for a folder that is not a finished twin or lacks a file.
    """
    record = read_record(folder)
    costs = _costs(folder)
    rows: dict[str, list[_Row]] = {name: [] for name in TABLES}
    rows["stages"] = _stages(record, costs)
    if record.rejection is not None:
        rows["rejections"] = [{**_origin(record, costs), **record.rejection.model_dump()}]
        return _as_tables(rows)
    rows["twins"] = [_twin(record, costs, read_shape(folder) or compute_shape(folder / VISUAL))]
    rows["points"] = [] if record.points is None else _points(record.twin_id, record.points)
    rows["placements"] = _placements(record)
    tables = _as_tables(rows)
    tables["grasps"] = _grasps(folder / GRASPS, record)
    return tables


def _as_tables(rows: dict[str, list[_Row]]) -> dict[str, pa.Table]:
    return {name: pa.Table.from_pylist(rows[name], schema=schema) for name, schema in TABLES.items()}


def _costs(folder: Path) -> dict[str, StageCost]:
    path = folder / RUN
    if not os.path.lexists(path):
        raise TwinError(f"{path}: missing; {REMEDY}")
    said = read_json_object(path, TwinError, inside=folder, name=str(path), remedy=REMEDY)
    try:
        return {name: _cost(cost) for name, cost in said["stages"].items()}
    except (KeyError, TypeError, AttributeError, AssetError) as error:
        raise TwinError(f"{path}: cannot be read ({error}); {REMEDY}") from error


def _cost(said: dict[str, Any]) -> StageCost:
    return StageCost(**{name: json_number(value, name) for name, value in said.items()})


def _origin(record: TwinRecord, costs: dict[str, StageCost]) -> _Row:
    source, provenance = record.source, record.provenance
    return {
        "twin_id": record.twin_id,
        "revision": record.revision,
        "name": record.name,
        "kind": source.kind,
        "source_sha256": source.sha256,
        "license": source.license,
        "config_sha256": provenance.config_sha256,
        "seed": provenance.seed,
        "seconds": sum(cost.seconds for cost in costs.values()),
        "cpu_seconds": sum(cost.cpu_seconds for cost in costs.values()),
        "cost_usd": sum(cost.cost_usd for cost in costs.values()),
    }


def _stages(record: TwinRecord, costs: dict[str, StageCost]) -> list[_Row]:
    ran = sorted(record.provenance.stages.items(), key=lambda stage: place_in_pipeline(stage[0]))
    return [
        {
            "twin_id": record.twin_id,
            "status": record.status,
            "position": position,
            "stage": name,
            **stage.model_dump(),
            **(asdict(costs[name]) if name in costs else {}),
        }
        for position, (name, stage) in enumerate(ran)
    ]


def _twin(record: TwinRecord, costs: dict[str, StageCost], descriptor: ShapeDescriptor) -> _Row:
    mesh, physical, language, points = record.mesh, record.physical, record.language, record.points
    if mesh is None or physical is None or language is None or points is None or record.grasps is None:
        raise AssertionError("the schema lets no accepted twin lack these")
    x, y, z = physical.extents_m
    placements = record.placements or []
    return {
        **_origin(record, costs),
        "attribution": record.source.attribution,
        **language.model_dump(exclude={"captions"}),
        "physical_material": physical.material,
        "mass_kg": physical.mass_kg.value,
        "mass_low_kg": physical.mass_kg.low,
        "mass_high_kg": physical.mass_kg.high,
        "mass_source": physical.mass_kg.source,
        "friction_static": physical.friction_static.value,
        "friction_dynamic": physical.friction_dynamic.value,
        "density_kg_m3": physical.density_kg_m3,
        "extent_x_m": x,
        "extent_y_m": y,
        "extent_z_m": z,
        "longest_m": physical.longest_m,
        "radius_of_gyration_m": descriptor.radius_of_gyration_m,
        "volume_m3": mesh.volume_m3,
        "area_m2": mesh.area_m2,
        "watertight": mesh.watertight,
        "hulls": mesh.hulls.count,
        "keeps_opening": mesh.hulls.keeps_opening,
        **_grasp_summary(record.grasps),
        "functional_points": len(points.functional),
        "grasp_points": len(points.grasp),
        "placements": len(placements),
        "upright_probability": sum(placement.probability for placement in placements if placement.upright),
        "failed_checks": [check.name for check in record.quality.checks if check.passed is False],
        "shape_descriptor": descriptor.values,
    }


def _grasp_summary(grasps: GraspSummary) -> _Row:
    names = (
        "gripper proposed simulated verified success_rate unfiltered_simulated unfiltered_success_rate approach_octants"
    )
    second, robustness = grasps.second_opinion, grasps.robustness
    return {
        **{name: getattr(grasps, name) for name in names.split()},
        "robust": robustness.robust if robustness else None,
        "robustness_median": robustness.median if robustness else None,
        "held_in_second_engine_share": second.holds_share if second else None,
        "kappa": second.kappa if second else None,
    }


def _points(twin_id: str, points: Points) -> list[_Row]:
    rows = []
    for role, chosen in (("functional", points.functional), ("grasp", points.grasp)):
        for point in chosen:
            row = point.model_dump(exclude={"id", "position_m", "normal", "rationale"})
            x, y, z = point.position_m
            normal_x, normal_y, normal_z = point.normal
            place = {"x_m": x, "y_m": y, "z_m": z, "normal_x": normal_x, "normal_y": normal_y, "normal_z": normal_z}
            rows.append({"twin_id": twin_id, "point_id": point.id, "role": role, **row, **place})
    return rows


def _placements(record: TwinRecord) -> list[_Row]:
    rows = []
    for number, placement in enumerate(record.placements or []):
        x, y, z = placement.position_m
        row = placement.model_dump(exclude={"position_m"})
        rows.append({"twin_id": record.twin_id, "number": number, "x_m": x, "y_m": y, "z_m": z, **row})
    return rows


def _grasps(path: Path, record: TwinRecord) -> pa.Table:
    """Return grasps.parquet with the twin's id, category and the row number prepended, best grasp first as in the file."""
    table = read_grasp_table(path)
    count = len(table)
    leading = [
        pa.array([record.twin_id] * count, pa.string()),
        pa.array([record.language.category if record.language else None] * count, pa.string()),
        pa.array(np.arange(count, dtype=np.int32)),
    ]
    return pa.Table.from_arrays([*leading, *table.columns], schema=TABLES["grasps"])
