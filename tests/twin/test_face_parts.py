from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from manitwin.errors import TwinError
from manitwin.formats.npy_file import labels_to_npy
from manitwin.twin.grasp_table import SCHEMA, read_grasp_table
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.part_records import FACE_PARTS
from manitwin.twin.store import RECORD, parse_record, write_twin_record
from twin_folders import twin_name, write_accepted

PART = {"id": "p0", "name": "lid", "source": "geometry", "confidence": 0.8, "faces": 2, "area_share": 0.2}
LABELS = np.array([0, 0, *[255] * 10], np.uint8)


def with_parts(root: Path, parts: list[dict[str, Any]], labels: np.ndarray | None) -> Path:
    folder = root / twin_name(write_accepted(root, 0))
    if labels is not None:
        (folder / FACE_PARTS).write_bytes(labels_to_npy(labels))
    record = parse_record((folder / RECORD).read_bytes()).model_dump(mode="json")
    del record["revision"]
    write_twin_record(folder, record | {"parts": [part | {"centroid_m": [0, 0, 0]} for part in parts]})
    return folder


def test_faces_have_their_parts(tmp_path: Path) -> None:
    twin = Twin(with_parts(tmp_path, [PART], LABELS), verify=True)
    assert np.array_equal(twin.face_parts(), LABELS)
    assert twin.record.parts[0].name == "lid" and FACE_PARTS in twin.record.files


def test_faces_of_a_twin_without_parts_have_none(tmp_path: Path) -> None:
    assert (Twin(with_parts(tmp_path, [], None)).face_parts() == 255).tolist() == [True] * 12


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        (LABELS[:-1], "11 faces, but visual.glb has 12"),
        (np.full(12, 1, np.uint8), "refers to part 1, but the record has 1"),
    ],
)
def test_parts_of_other_faces_are_refused(tmp_path: Path, labels: np.ndarray, message: str) -> None:
    twin = Twin(with_parts(tmp_path, [PART], labels))
    with pytest.raises(TwinError, match=message):
        twin.face_parts()


@pytest.mark.parametrize(("parts", "labels"), [([PART], None), ([], LABELS), ([PART | {"id": "p1"}], LABELS)])
def test_table_and_file_of_parts_belong_together(
    tmp_path: Path, parts: list[dict[str, Any]], labels: np.ndarray | None
) -> None:
    with pytest.raises(ValueError, match="parts"):
        with_parts(tmp_path, parts, labels)


def test_grasps_of_version_1_touch_no_part(tmp_path: Path) -> None:
    rows = {name: [None] for name in SCHEMA.names if name != "part_id"}
    schema = SCHEMA.remove(SCHEMA.get_field_index("part_id"))
    pq.write_table(pa.table(rows, schema=schema), tmp_path / "grasps.parquet")
    table = read_grasp_table(tmp_path / "grasps.parquet")
    assert table.schema.equals(SCHEMA) and table["part_id"].to_pylist() == [None]
