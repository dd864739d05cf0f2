import json
import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import trimesh

from manitwin.config import BuildConfig
from manitwin.dataset.index.rows import rows_of
from manitwin.dataset.index.tables import TABLES
from manitwin.errors import TwinError
from manitwin.geometry.shape_descriptor import shape_descriptor
from manitwin.pipeline.recipe import stages_for
from manitwin.pipeline.stage_order import STAGE_ORDER
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.grasp_table import SCHEMA
from manitwin.twin.store import read_record
from twin_folders import box, grasp_table, twin_id, write_accepted, write_rejected

STAGES = len(STAGE_ORDER[3:])  # of a mesh


def test_every_table_has_exactly_the_columns_of_its_schema(tmp_path: Path) -> None:
    for write in (write_accepted, write_rejected):
        rows = rows_of(tmp_path / twin_name(write(tmp_path, 1)))
        assert {name: table.schema for name, table in rows.items()} == TABLES


def test_page_names_every_column() -> None:
    page = (Path(__file__).parents[3] / "docs" / "dataset.md").read_text()
    for table, schema in TABLES.items():
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{table}` |")]
        words = set(re.findall(r"\w+", row))
        assert set(schema.names[:3] if table == "grasps" else schema.names) <= words


def test_the_longest_side_is_that_of_the_oriented_box(tmp_path: Path) -> None:
    """Of a thing turned by 45 degrees in its frame: along the axes a long one is too short, a square one too long."""
    folder = tmp_path / twin_name(write_accepted(tmp_path, 3))
    document = json.loads((folder / "twin.json").read_text())
    turn = np.eye(4)
    turn[:2, :2] = np.sqrt(0.5) * np.array([[1, -1], [1, 1]])
    for sides in ((0.3, 0.02, 0.01), (0.2, 0.2, 0.05)):
        along = float((sides[0] + sides[1]) * np.sqrt(0.5))
        document["physical"] |= {"extents_m": [along, along, sides[2]]}
        document["physical"]["obb"] |= {"extents_m": list(sides), "obb_to_object": turn.tolist()}
        (folder / "twin.json").write_text(json.dumps(document))
        (row,) = rows_of(folder)["twins"].to_pylist()
        assert (row["longest_m"], row["extent_x_m"]) == (sides[0], along)
        assert read_record(folder).physical.longest_m == sides[0]  # type: ignore[union-attr]


def test_accepted_twin_says_in_its_row_what_its_record_says(tmp_path: Path) -> None:
    folder = tmp_path / twin_name(write_accepted(tmp_path, 3, category="bowl", mass_kg=0.25, grasps=12))
    record, rows = read_record(folder), rows_of(folder)
    (row,) = rows["twins"].to_pylist()
    known = {
        "twin_id": twin_id(3),
        "revision": record.revision,
        "source_sha256": record.source.sha256,
        "kind": "mesh",
        "category": "bowl",
        "material": "glazed ceramic",
        "physical_material": "ceramic",
        "attribution": "Ada",
        "mass_kg": 0.25,
        "mass_low_kg": 0.125,
        "mass_high_kg": 0.5,
        "mass_source": "prior:mug",
        "hulls": 2,
        "longest_m": pytest.approx(0.1),
        "extent_y_m": pytest.approx(0.06),
        "volume_m3": pytest.approx(0.04 * 0.06 * 0.1),
        "verified": 3,
        "simulated": 10,
        "kappa": 0.25,
        "held_in_second_engine_share": 0.75,
        "robust": None,
        "functional_points": 1,
        "grasp_points": 2,
        "placements": 3,
        "upright_probability": 0.625,
        "failed_checks": ["known_name"],
        "seconds": 2.0 * STAGES,
        "cpu_seconds": 1.0 * STAGES,
        "cost_usd": 0.125 * STAGES,
        "config_sha256": "c0",
        "shape_descriptor": pytest.approx(shape_descriptor(box(), seed=0).values.tolist(), abs=1e-4),  # GLB is float32
    }
    assert {name: row[name] for name in known} == known
    assert [rows[name].num_rows for name in ("points", "grasps", "placements", "rejections", "stages")] == [
        3,
        12,
        3,
        0,
        STAGES,
    ]


def test_points_and_placements_keep_place_and_meaning(tmp_path: Path) -> None:
    rows = rows_of(tmp_path / twin_name(write_accepted(tmp_path, 3)))
    functional, first, _ = rows["points"].to_pylist()
    place = {"x_m": 0.01, "y_m": 0.02, "z_m": 0.03, "normal_z": 1.0}
    assert (
        functional.items() >= {**place, "role": "functional", "point_id": "f0", "label": "handle", "type": None}.items()
    )
    assert first.items() >= {**place, "role": "grasp", "point_id": "g0", "type": "pinch", "scenario": "lift"}.items()
    assert [(p["number"], p["probability"]) for p in rows["placements"].to_pylist()] == [
        (0, 0.5),
        (1, 0.25),
        (2, 0.125),
    ]


def test_grasps_are_the_rows_of_the_twins_own_table_in_its_order(tmp_path: Path) -> None:
    rows = rows_of(tmp_path / twin_name(write_accepted(tmp_path, 5, category="can", grasps=9)))["grasps"]
    assert rows.select(SCHEMA.names).equals(grasp_table(5, 9))
    assert rows["number"].to_pylist() == list(range(9))
    assert set(rows["category"].to_pylist()) == {"can"} and set(rows["twin_id"].to_pylist()) == {twin_id(5)}


def test_rejected_twin_is_in_rejections_alone(tmp_path: Path) -> None:
    rows = rows_of(tmp_path / twin_name(write_rejected(tmp_path, 2)))
    assert {name for name, table in rows.items() if table.num_rows} == {"rejections", "stages"}
    (row,) = rows["rejections"].to_pylist()
    assert row.items() >= {"twin_id": twin_id(2), "stage": "gate", "reason": "several_objects", "seconds": 6.0}.items()
    assert [s["stage"] for s in rows["stages"].to_pylist()] == ["mesh", "views", "gate"]
    assert {s["status"] for s in rows["stages"].to_pylist()} == {"rejected"}


def test_stages_stand_in_the_order_of_the_pipeline(tmp_path: Path) -> None:
    config = BuildConfig(grippers=("panda", "robotiq_2f85"))
    names = [stage.name for stage in stages_for("image", config)]
    assert [name for name in names if "-" not in name] == list(STAGE_ORDER)
    folder = tmp_path / twin_name(write_accepted(tmp_path, 1))
    data = json.loads((folder / "twin.json").read_text())
    data["provenance"]["stages"] = {n: {"version": "1", "backend": "b", "model": None} for n in sorted(names)}
    (folder / "twin.json").write_text(json.dumps(data))
    stages = rows_of(folder)["stages"].to_pylist()
    assert [stage["stage"] for stage in stages] == names
    assert [stage["position"] for stage in stages] == list(range(len(names)))
    assert stages[0]["seconds"] is None and stages[3]["seconds"] == 2.0  # the photo stage left no costs


@pytest.mark.parametrize("name", ["twin.json", "run.json", "visual.glb", "grasps.parquet"])
def test_missing_or_broken_file_is_named(tmp_path: Path, name: str) -> None:
    folder = tmp_path / twin_name(write_accepted(tmp_path, 1))
    (folder / name).write_bytes(b"\0broken")
    with pytest.raises(TwinError, match=f"{name}.*build the twin again"):
        rows_of(folder)
    (folder / name).unlink()
    with pytest.raises(TwinError, match=name):
        rows_of(folder)


def test_mesh_without_area_is_an_error_that_names_its_file(tmp_path: Path) -> None:
    folder = tmp_path / twin_name(write_accepted(tmp_path, 1))
    flat = trimesh.Trimesh(np.zeros((3, 3)), [[0, 1, 2]], process=False)
    (folder / "visual.glb").write_bytes(trimesh.Scene(flat).export(file_type="glb"))
    with pytest.raises(TwinError, match=r"visual\.glb: a surface of 0 m2"):
        rows_of(folder)


def test_grasp_table_of_another_version_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / twin_name(write_accepted(tmp_path, 1))
    pq.write_table(pa.table({"grasp_id": ["a"]}), folder / "grasps.parquet")
    with pytest.raises(TwinError, match="has no column gripper; build the twin again"):
        rows_of(folder)
