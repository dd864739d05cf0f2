"""What the audit finds in a twin's folder: altered files, and a record that is not of its mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from broken_mugs import codes, errors
from made_mug import solid, write_twin

from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.rules import RULES
from manitwin.formats.npy_file import labels_to_npy
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.part_records import FACE_PARTS
from manitwin.twin.store import RECORD, parse_record, write_twin_record
from twin_folders import write_rejected


def test_no_rule_complains_of_the_mug_as_a_twin(tmp_path: Path) -> None:
    assert audit_path(write_twin(tmp_path), RULES).findings == ()


def test_twin_with_an_altered_file(tmp_path: Path) -> None:
    folder = write_twin(tmp_path)
    with (folder / "source.obj").open("ab") as stream:
        stream.write(b"# edited\n")
    findings = audit_path(folder, RULES).findings
    assert codes(findings) == {"FIL004"} and "source.obj" in findings[0].message


def test_rejected_twin_is_a_note(tmp_path: Path) -> None:
    identity = write_rejected(tmp_path, 1)
    folder = next(path.parent for path in tmp_path.rglob(RECORD) if path.parent.name == identity)
    findings = audit_path(folder, RULES).findings
    assert codes(findings) == {"FIL008"} and findings[0].severity == "note"


def test_twin_whose_candidates_are_off_its_surface(tmp_path: Path) -> None:
    points = solid().vertices[::50] + np.array([0, 0, 0.05])
    changes = {"points": {"candidates": {"positions_m": points.tolist()}}}
    assert errors(audit_path(write_twin(tmp_path, changes), RULES).findings) == {"TWN001"}


def test_twin_whose_record_has_another_size(tmp_path: Path) -> None:
    changes = {"physical": {"extents_m": [0.2, 0.1, 0.1]}}
    assert errors(audit_path(write_twin(tmp_path, changes), RULES).findings) == {"TWN002"}


def test_twin_whose_parts_have_other_faces_than_the_record_says(tmp_path: Path) -> None:
    folder = write_twin(tmp_path)
    labels = np.zeros(len(Twin(folder).face_parts()), np.uint8)
    (folder / FACE_PARTS).write_bytes(labels_to_npy(labels))
    record = parse_record((folder / RECORD).read_bytes()).model_dump(mode="json")
    part = {
        "id": "p0",
        "name": "body",
        "source": "geometry",
        "confidence": 0.8,
        "area_share": 1.0,
        "centroid_m": [0, 0, 0],
    }
    for faces, found in ((len(labels), set()), (len(labels) - 1, {"TWN003"})):
        record.pop("revision", None)
        write_twin_record(folder, {**record, "parts": [part | {"faces": faces}]})
        assert errors(audit_path(folder, RULES).findings) == found


def test_twin_whose_frames_are_beside_their_feature_or_of_another_kind(tmp_path: Path) -> None:
    folder = write_twin(tmp_path)
    record = parse_record((folder / RECORD).read_bytes()).model_dump(mode="json")
    on_surface = np.asarray(solid().triangles_center[0])
    frame_of = {"quaternion_wxyz": [1, 0, 0, 0], "kind": "tip", "size_m": 0.01, "free": "roll", "source": "geometry"}
    point = {
        "id": "f0",
        "candidate": 0,
        "position_m": [0, 0, 0],
        "normal": [0, 0, 1],
        "description": "a place",
        "confidence": 1,
        "rationale": "for a test",
    }
    for label, kind, lifted_m, found in (
        ("tip", "tip", 0.0, set()),
        ("tip", "tip", 0.05, {"TWN004"}),
        ("base", "edge", 0.0, {"TWN005"}),
    ):
        frame = frame_of | {"kind": kind, "position_m": (on_surface + np.array([0, 0, lifted_m])).tolist()}
        record.pop("revision", None)
        record["points"]["functional"] = [point | {"label": label, "frame": frame}]
        write_twin_record(folder, record)
        assert {code for code in codes(audit_path(folder, RULES).findings) if code in ("TWN004", "TWN005")} == found
