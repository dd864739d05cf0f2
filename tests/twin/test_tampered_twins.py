"""Twins that somebody altered: nothing out of their folder is read, whatever reads them, and what is wrong takes one line."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import manitwin
import manitwin.cli.main as main_module
from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.selection import select_rules
from manitwin.assets.importers.importer import import_assets
from manitwin.errors import TwinError
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD, canonical_json, read_record, revision_of, write_twin_record
from scene_twins import slab, write_thing
from twin_folders import twin_id, write_accepted

CANARY = "CANARY-7f3a9c"


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("tampered")
    write_thing(root, 3, slab("box", 0.04, 0.06, 0.1))
    return next(root.glob("twins/*/*"))


@pytest.fixture
def twin(sound: Path, tmp_path: Path) -> Path:
    """A twin of its own for every test, beside a file that nobody may read."""
    (tmp_path / "secret.txt").write_text(CANARY)
    return Path(shutil.copytree(sound, tmp_path / "in" / sound.name))


def resealed(folder: Path, *path: str | int, value: Any) -> None:
    """Put a value into the record, and a revision that fits."""
    record = json.loads((folder / RECORD).read_text())
    place: Any = record
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    record["revision"] = revision_of(record)
    (folder / RECORD).write_text(canonical_json(record))


def replaced_by_link(folder: Path, name: str, target: str | Path) -> None:
    (folder / name).unlink(missing_ok=True)
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).symlink_to(target)


def pipe(folder: Path, name: str) -> None:
    (folder / name).unlink(missing_ok=True)
    os.mkfifo(folder / name)


def collision_elsewhere(folder: Path) -> None:
    shutil.copytree(folder / "collision", folder.parent / "collision")
    shutil.rmtree(folder / "collision")
    (folder / "collision").symlink_to(folder.parent / "collision")


def linked_twice_out(folder: Path) -> None:
    replaced_by_link(folder, "a", "../../secret.txt")
    replaced_by_link(folder, "b", "a")


LINKS: dict[str, Callable[[Path], None]] = {
    "visual out": lambda f: replaced_by_link(f, "visual.glb", f.parents[1] / "secret.txt"),
    "visual out by dots": lambda f: replaced_by_link(f, "visual.glb", "../../secret.txt"),
    "hull a device": lambda f: replaced_by_link(f, "collision/hull_00.obj", "/dev/zero"),
    "hull a pipe": lambda f: pipe(f, "collision/hull_00.obj"),
    "hull that no record names": lambda f: replaced_by_link(f, "collision/hull_99.obj", "/dev/zero"),
    "folder of hulls out": collision_elsewhere,
    "grasps a pipe": lambda f: pipe(f, "grasps.parquet"),
    "source out": lambda f: replaced_by_link(f, "source.obj", "../../secret.txt"),
    "card a loop": lambda f: replaced_by_link(f, "card.png", "card.png"),
    "card to nowhere": lambda f: replaced_by_link(f, "card.png", "/nonexistent"),
    "record out": lambda f: replaced_by_link(f, RECORD, "../../secret.txt"),
    "record a pipe": lambda f: pipe(f, RECORD),
    "link to a link out": linked_twice_out,
}

RECORDS: dict[str, Callable[[Path], object]] = {
    "deep": lambda f: (f / RECORD).write_text("[" * 200_000),
    "huge integer": lambda f: (f / RECORD).write_text('{"schema_version": ' + "9" * 10_000 + "}"),
    "1e400": lambda f: (f / RECORD).write_text('{"schema_version": 1e400}'),
    "binary": lambda f: (f / RECORD).write_bytes(bytes(range(256))),
    "empty": lambda f: (f / RECORD).write_bytes(b""),
    "a list": lambda f: (f / RECORD).write_text("[1]"),
    "id of another folder": lambda f: resealed(f, "twin_id", value="../../../evil"),
    "source of another folder": lambda f: resealed(f, "source", "file", value="../../secret.txt"),
    "absolute source": lambda f: resealed(f, "source", "file", value=str(f.parents[1] / "secret.txt")),
    "file of another folder": lambda f: resealed(f, "files", value={"../../secret.txt": "0" * 64}),
    "mass below nothing": lambda f: resealed(
        f, "physical", "mass_kg", value={"value": -1.0, "low": -2.0, "high": 0.0, "source": "user"}
    ),
    "mass of no thing": lambda f: resealed(
        f, "physical", "mass_kg", value={"value": 1e300, "low": 0.0, "high": 1e301, "source": "user"}
    ),
    "size of no thing": lambda f: resealed(f, "physical", "extents_m", value=[1e300, 1.0, 1.0]),
    "inertia of no thing": lambda f: resealed(f, "physical", "inertia_kg_m2", value=[[1e300] * 3] * 3),
    "escape in a name": lambda f: resealed(f, "name", value="a\x1b[31m"),
    "NUL in a key": lambda f: resealed(f, "files", value={"a\0b": "0" * 64}),
    "surrogate": lambda f: (f / RECORD).write_text(
        (f / RECORD).read_text().replace('"name": "', '"name": "\\ud800', 1)
    ),
}


@pytest.mark.parametrize("change", [*LINKS, *RECORDS])
def test_everything_that_reads_a_twin_refuses_it_in_one_line(
    change: str, twin: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (LINKS | RECORDS)[change](twin)
    for reads in (read_record, Twin, manitwin.load, lambda folder: read_record(folder, verify=True)):
        with pytest.raises(TwinError) as found:
            reads(twin)
        assert len(str(found.value).splitlines()) == 1 and CANARY not in str(found.value)
    commands = (
        ["show"],
        ["export", "-o", str(tmp_path / "out")],
        ["audit"],
        ["import", "-o", str(tmp_path / "imported")],
    )
    for command in commands:
        monkeypatch.setattr(sys, "argv", ["manitwin", command[0], str(twin), *command[1:]])
        status = main_module._run()
        said = capsys.readouterr()
        assert status in (1, 2, 3), command
        assert "Traceback" not in said.err + said.out and CANARY not in said.err + said.out
    assert not [path for path in tmp_path.glob("out/**/*") if path.is_file()]


@pytest.mark.parametrize("change", sorted(LINKS))
def test_audit_and_import_say_which_file_it_is(change: str, twin: Path, tmp_path: Path) -> None:
    LINKS[change](twin)
    audited = audit_path(twin, select_rules([""], [""]))
    assert [finding.code for finding in audited.findings] == ["FIL001"]
    (imported,) = import_assets([twin], tmp_path / "imported")
    assert imported.folder is None and imported.error is not None


def test_links_inside_of_the_folder_are_read(twin: Path) -> None:
    (twin / "visual.glb").rename(twin / "elsewhere.glb")
    (twin / "visual.glb").symlink_to("elsewhere.glb")
    assert Twin(twin).visual and read_record(twin, verify=True)


def test_hulls_are_read_with_comments_and_normals_and_refused_without_triangles(twin: Path) -> None:
    hull = next((twin / "collision").glob("hull_*.obj"))
    whole = Twin(twin).hulls[0]
    lines = hull.read_text().splitlines()
    faces = [
        "f " + " ".join(f"{word.partition('/')[0]}//1" for word in line.split()[1:])
        for line in lines
        if line[:2] == "f "
    ]
    hull.write_text("\n".join(["# made by hand", "vn 0 0 1", *(line for line in lines if line[:2] == "v "), *faces]))
    read = Twin(twin).hulls[0]
    assert (read.vertices == whole.vertices).all() and (read.faces == whole.faces).all()
    for broken, why in (
        ("", "not a hull with finite"),
        ("v 0 0 0\n", "not a hull with finite"),
        ("v 0 0 0\nf 1 2 3\n", "not a hull with finite"),
        ("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not a hull with finite"),
        ("f " + "9" * 400, "not a readable hull"),
        ("\0\xff", "not a hull with finite"),
    ):
        hull.write_text(broken)
        with pytest.raises(TwinError, match=rf"hull_\d+\.obj: {why}"):
            Twin(twin).hulls  # noqa: B018


def test_controls_of_a_name_are_written_out_when_a_twin_is_sealed(tmp_path: Path) -> None:
    write_accepted(tmp_path, 1)
    folder = tmp_path / twin_name(twin_id(1))
    record = json.loads((folder / RECORD).read_text())
    record["language"]["caption"] = "a\x1b[2J\x00 mug\nof clay"
    sealed = write_twin_record(
        folder, {key: value for key, value in record.items() if key not in ("files", "revision")}
    )
    assert sealed.language is not None and sealed.language.caption == "a\\x1b[2J\\x00 mug\nof clay"
    assert read_record(folder, verify=True) == sealed
