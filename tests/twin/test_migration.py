import json
from pathlib import Path

import pytest
from rejected_records import rejected_record

from manitwin.errors import NewerVersion, TwinError
from manitwin.twin.migration import SCHEMA_VERSION, migrate_record
from manitwin.twin.point_records import FunctionalPoint, Points
from manitwin.twin.store import (
    RECORD,
    canonical_json,
    parse_record,
    read_record,
    replace_files,
    revision_of,
    write_twin_record,
)

POINT = {
    "id": "f0", "candidate": 0, "position_m": [0, 0, 0], "normal": [0, 0, 1], "label": "tip", "description": "a tip",
    "confidence": 0.5, "rationale": "outermost",
}  # fmt: skip


@pytest.fixture
def of_version_1(tmp_path: Path) -> Path:
    folder = tmp_path / "abc"
    folder.mkdir()
    (folder / "source.png").write_bytes(b"")
    write_twin_record(folder, rejected_record())
    said = json.loads((folder / RECORD).read_text()) | {"schema_version": 1}
    said["points"] = {
        "candidates": {"positions_m": [[0, 0, 0]], "normals": [[0, 0, 1]]},
        "functional": [POINT],
        "grasp": [],
    }
    said["revision"] = revision_of(said)
    (folder / RECORD).write_text(canonical_json(said))
    return folder


def test_record_of_version_1_is_read_verified_without_frames(of_version_1: Path) -> None:
    record = read_record(of_version_1, verify=True)
    assert record.schema_version == SCHEMA_VERSION
    assert record.points is not None and record.points.functional[0].frame is None
    assert record.points.candidates.refined == []
    assert migrate_record({"schema_version": 2, "name": "x"}) == {"schema_version": SCHEMA_VERSION, "name": "x"}
    content = (of_version_1 / RECORD).read_bytes()
    assert parse_record(content, sealed=True).revision == json.loads(content)["revision"]


def test_altered_record_of_version_1_is_refused(of_version_1: Path) -> None:
    content = (of_version_1 / RECORD).read_bytes().replace(b"nothing in it", b"something in it")
    with pytest.raises(TwinError, match="altered"):
        parse_record(content, sealed=True)


def test_amended_record_of_version_1_is_written_in_the_present_one(of_version_1: Path) -> None:
    replace_files(of_version_1, {"source.png": b"x"})
    assert json.loads((of_version_1 / RECORD).read_text())["schema_version"] == SCHEMA_VERSION
    read_record(of_version_1, verify=True)


@pytest.mark.parametrize("version", [None, "1", 1.0, True, 0, 99, [1]])
def test_unknown_version_is_left_as_it_is(version: object) -> None:
    assert migrate_record({"schema_version": version}) == {"schema_version": version}


def test_frame_that_is_no_rotation_is_refused() -> None:
    frame = {"position_m": [0, 0, 0], "quaternion_wxyz": [1, 0, 0, 0], "kind": "tip", "size_m": 0.01, "free": "roll"}
    good = FunctionalPoint(**POINT, frame=frame | {"source": "geometry"})
    assert Points(candidates={"positions_m": [], "normals": []}, functional=[good], grasp=[]).functional[0].frame
    for wrong in ({"quaternion_wxyz": [1, 1, 0, 0]}, {"size_m": 0}, {"kind": "lid"}, {"source": ""}):
        with pytest.raises(ValueError):
            FunctionalPoint(**POINT, frame=frame | {"source": "geometry"} | wrong)


def test_a_record_of_a_newer_version_is_told_as_that_and_not_as_damage(of_version_1: Path) -> None:
    said = json.loads((of_version_1 / RECORD).read_text()) | {"schema_version": SCHEMA_VERSION + 1, "weather": "fine"}
    said["revision"] = revision_of(said)
    (of_version_1 / RECORD).write_text(canonical_json(said))
    with pytest.raises(
        NewerVersion, match=f"twin.json: of schema {SCHEMA_VERSION + 1}, .* up to {SCHEMA_VERSION}; use the version"
    ):
        read_record(of_version_1, verify=True)
