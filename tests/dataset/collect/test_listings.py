"""Listings of data sets of meshes: every entry is a row with its licence and author, as an address or as a file."""

from __future__ import annotations

import gzip
import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from manitwin.dataset.collect.intake import DefaultValues, add_inputs
from manitwin.errors import UsageError

UID = "8476c4170df24cf5bbe6967222d1a42d"
OBJAVERSE = {
    UID: {
        "uid": UID,
        "name": "Mug",
        "license": "by",
        "viewerUrl": f"https://sketchfab.com/3d-models/{UID}",
        "user": {"username": "ada", "displayName": "Ada"},
        "tags": [{"name": "cup"}],
    },
    "0" * 32: {"uid": "0" * 32, "name": "Scene 7", "license": "by-nc-sa", "user": {"username": "ben"}},
}
FUEL = [
    {
        "owner": "GoogleResearch",
        "name": "Claw_Hammer",
        "license_name": "Creative Commons Attribution 4.0 International",
    },
    {"owner": "GoogleResearch"},
]


def packed(folder: Path, told: Any, name: str = "000-023.json.gz") -> Path:
    (folder / "metadata").mkdir(exist_ok=True)
    path = folder / "metadata" / name
    content = json.dumps(told).encode()
    path.write_bytes(gzip.compress(content) if name.endswith(".gz") else content)
    return path


def rows(catalogue: Path, columns: str) -> list[tuple[object, ...]]:
    with closing(sqlite3.connect(catalogue)) as connection:
        return connection.execute(f"SELECT {columns} FROM inputs ORDER BY number").fetchall()


def test_objaverses_metadata_are_addresses_with_licence_and_author(tmp_path: Path) -> None:
    done = add_inputs(tmp_path / "c.db", packed(tmp_path, OBJAVERSE), DefaultValues())
    assert (done.new, done.refused) == (2, [])
    assert rows(tmp_path / "c.db", "place, licence, attribution, category, source, status") == [
        (
            f"https://sketchfab.com/3d-models/{UID}", "CC-BY-4.0", f"Ada, https://sketchfab.com/3d-models/{UID}", "mug",
            "Objaverse 1.0", "listed",
        ),
        (
            f"https://sketchfab.com/3d-models/{'0' * 32}", "CC-BY-NC-SA-4.0",
            f"ben, https://sketchfab.com/3d-models/{'0' * 32}", "unknown", "Objaverse 1.0", "listed",
        ),
    ]  # fmt: skip


def test_with_a_root_the_files_that_were_fetched_are_meant(tmp_path: Path) -> None:
    (tmp_path / "glbs" / "000-023").mkdir(parents=True)
    (tmp_path / "glbs" / "000-023" / f"{UID}.glb").write_bytes(b"glTF")
    add_inputs(tmp_path / "c.db", packed(tmp_path, OBJAVERSE), DefaultValues(), root=tmp_path)
    assert rows(tmp_path / "c.db", "kind, status, licence") == [
        ("mesh", "ready", "CC-BY-4.0"), ("mesh", "unreadable", "CC-BY-NC-SA-4.0"),
    ]  # fmt: skip


def test_fuels_models_are_rows_and_one_without_a_name_is_a_counted_cause(tmp_path: Path) -> None:
    done = add_inputs(tmp_path / "c.db", packed(tmp_path, FUEL, "models.json"), DefaultValues())
    assert done.new == 1 and [(each.cause, each.count) for each in done.refused] == [
        ("has neither a file nor a url", 1)
    ]
    assert rows(tmp_path / "c.db", "place, name, category, licence, source") == [
        (
            "https://fuel.gazebosim.org/1.0/GoogleResearch/models/Claw_Hammer", "Claw Hammer", "hammer", "CC-BY-4.0",
            "Gazebo Fuel: GoogleResearch",
        )
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({}, "not a known listing"),
        ([1], "not a known listing"),
        ({"a": {"name": "x"}}, "not a known listing"),
        ("mug", "not a known listing"),
    ],
)
def test_other_json_is_refused_as_a_whole(told: Any, said: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=said):
        add_inputs(tmp_path / "c.db", packed(tmp_path, told), DefaultValues())


def test_a_file_that_is_not_packed_is_refused_in_one_line(tmp_path: Path) -> None:
    path = packed(tmp_path, OBJAVERSE)
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(UsageError, match="cannot be unpacked"):
        add_inputs(tmp_path / "c.db", path, DefaultValues())
