"""Exports on disk: whole or not at all, never outside their folder, the same bytes again."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from lxml import etree
from pydantic import ValidationError

import exported_twins as made
from manitwin.assets.writers.exporter import Exported, TwinContent, export_name
from manitwin.assets.writers.format_notes import NOTES, QUANTITIES
from manitwin.assets.writers.mesh_files import obj_file
from manitwin.assets.writers.registry import chosen_formats, exporter, formats
from manitwin.assets.writers.write import export_twin, safe_name, write_exported
from manitwin.errors import ExportError, TwinError, UsageError
from manitwin.formats.markdown import markdown_escaped
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.record_values import Estimate

OURS = ("mjcf", "urdf", "sdf", "glb")
HOSTILE = 'Ada --> <script>alert(1)</script> --\x00\ud800\n# [x](http://evil) & "Söhne" ---'


@pytest.fixture
def twin(tmp_path: Path) -> TwinContent:
    return made.content(tmp_path / "twin")


def digests(folder: Path) -> dict[str, str]:
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    return {p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


@pytest.mark.parametrize("name", OURS)
def test_the_same_twin_gives_the_same_bytes_wherever_it_lies(name: str, twin: TwinContent, tmp_path: Path) -> None:
    shutil.copytree(tmp_path / "twin", tmp_path / "elsewhere" / "copy")
    export_twin(twin, name, tmp_path / "a")
    export_twin(TwinContent.of(Twin(tmp_path / "elsewhere" / "copy")), name, tmp_path / "b")
    assert digests(tmp_path / "a") == digests(tmp_path / "b")
    for file in (p for p in (tmp_path / "a").rglob("*") if p.is_file()):
        assert str(tmp_path).encode() not in file.read_bytes()


@pytest.mark.parametrize(
    "name",
    [
        "../evil",
        "a/../../evil",
        "/etc/evil",
        "",
        ".",
        "a//b",
        "a/./b",
        "a\\..\\evil",
        "C:evil",
        "a\0b",
        "a\nb",
        " a",
        "x" * 256,
    ],
)
def test_names_that_leave_the_folder_are_refused_before_anything_is_written(name: str, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="no name for a file below"):
        write_exported(Exported({"fine.txt": b"1", name: b"2"}, "fine.txt"), tmp_path / "out" / "mjcf")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("twin_id", ["../../ev", "/etc/evi", "..", "a/b"])
def test_a_record_cannot_choose_where_its_export_goes(twin_id: str, tmp_path: Path) -> None:
    with pytest.raises(ValidationError, match="twin_id"):
        made.content(tmp_path / "in" / "twin", twin_id=twin_id)
    shutil.rmtree(tmp_path / "in")
    sound = made.content(tmp_path / "in" / "twin")
    record = sound.record.model_copy(update={"twin_id": twin_id})  # as a reader of another kind might let it through
    twin = replace(sound, name=export_name(record), record=record)
    before = digests(tmp_path)
    for name in OURS:
        if "/" in twin_id:
            with pytest.raises(ExportError, match="no name for a file"):
                export_twin(twin, name, tmp_path / "out")
            assert digests(tmp_path) == before
        else:
            assert export_twin(twin, name, tmp_path / "out").is_relative_to(tmp_path / "out" / "claw_hammer_..")


def test_names_that_differ_in_case_only_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="case only"):
        write_exported(Exported({"a.obj": b"1", "A.obj": b"2"}, "a.obj"), tmp_path / "mjcf")


def test_a_write_that_fails_leaves_the_older_export_whole(
    twin: TwinContent, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export_twin(twin, "urdf", tmp_path / "out")
    before = digests(tmp_path / "out")
    write, count = Path.write_bytes, [0]

    def full_disk(path: Path, data: bytes) -> int:
        count[0] += 1
        if count[0] == 3:
            raise OSError(28, "No space left on device")
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", full_disk)
    with pytest.raises(ExportError, match="No space left on device"):
        export_twin(twin, "urdf", tmp_path / "out")
    assert digests(tmp_path / "out") == before
    assert os.listdir(tmp_path / "out" / made.NAME) == ["urdf"]


def test_an_older_export_is_replaced_as_a_whole(twin: TwinContent, tmp_path: Path) -> None:
    folder = export_twin(twin, "urdf", tmp_path).parent
    (folder / "meshes" / "stale.obj").write_bytes(b"")
    export_twin(twin, "urdf", tmp_path)
    assert not (folder / "meshes" / "stale.obj").exists()


@pytest.mark.parametrize("name", ["mjcf", "urdf", "sdf"])
def test_hostile_words_stay_words_in_xml(name: str, tmp_path: Path) -> None:
    twin = made.content(tmp_path / "twin", source={"attribution": HOSTILE.replace("\ud800", ""), "license": "x--y"})
    for file in exporter(name)(twin).files.items():
        if file[0].endswith((".xml", ".urdf", ".sdf", ".config")):
            root = etree.fromstring(file[1])
            assert root.find(".//script") is None
            comments = [c.text for c in root.iterchildren(etree.Comment)]
            assert any("script" in text for text in comments) and any("license: x- -y" in text for text in comments)


def test_hostile_words_stay_words_in_the_readme(tmp_path: Path) -> None:
    words = markdown_escaped(HOSTILE)
    assert "\n" not in words and "&lt;script&gt;" in words and "\\[x\\](" in words
    twin = made.content(tmp_path / "twin", language={"caption": "</p><script>\n# Title"})
    text = (export_twin(twin, "urdf", tmp_path / "out").parent / "README.md").read_text()
    assert "<script" not in text and "\n# Title" not in text


@pytest.mark.parametrize("mesh_file", ["visual_00", "visual_01", "hull_02"])
def test_meshes_are_closed_solids_in_metres(mesh_file: str, twin: TwinContent, tmp_path: Path) -> None:
    folder = export_twin(twin, "urdf", tmp_path).parent / "meshes"
    rows = [line.split() for line in (folder / f"{made.NAME}_{mesh_file}.obj").read_text().splitlines()]
    vertices = np.array([row[1:] for row in rows if row[0] == "v"], float)
    faces = np.array([[corner.split("/")[0] for corner in row[1:]] for row in rows if row[0] == "f"], int) - 1
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    hull = made.hulls()[int(mesh_file[-2:])]
    assert mesh.is_watertight  # also where texture seams split the vertices
    np.testing.assert_allclose(mesh.bounds, [hull.min(0), hull.max(0)], atol=1e-6)
    assert mesh.volume > 0


def test_numbers_read_back_as_they_were() -> None:
    exact = np.array([[0.1, -0.0, 1 / 3], [1e-7, 2.0, 3.0], [0.123456789012345, 1.0, 0.0]])
    rows = [line.split()[1:] for line in obj_file(exact, np.array([[0, 1, 2]])).decode().splitlines()[:3]]
    assert sorted(map(tuple, np.array(rows, float).tolist())) == sorted(map(tuple, exact.tolist()))
    assert "-0.0" not in {number for row in rows for number in row}


@pytest.mark.parametrize("name", ["mjcf", "urdf", "sdf"])
def test_every_file_that_is_named_is_there_and_nothing_is_scaled(name: str, twin: TwinContent, tmp_path: Path) -> None:
    main = export_twin(twin, name, tmp_path)
    text = main.read_text()
    named = re.findall(r"(?:file|filename)=\"([^\"]+)\"|<uri>([^<]+)</uri>", text)
    assert len(named) >= 6
    assert all((main.parent / (a or b)).is_file() for a, b in named)
    for mesh in main.parent.rglob("*.obj"):  # and what the meshes name in turn
        libraries = re.findall(r"^mtllib (.+)$", mesh.read_text(), re.MULTILINE)
        textures = [
            t for each in libraries for t in re.findall(r"^map_Kd (.+)$", (mesh.parent / each).read_text(), re.M)
        ]
        assert all((mesh.parent / each).is_file() for each in textures)
    assert "scale" not in text and "package://" not in text


def test_sdf_has_author_and_licence_in_its_model_config(twin: TwinContent, tmp_path: Path) -> None:
    main = export_twin(twin, "sdf", tmp_path)
    assert main.parent.name == made.NAME  # model://<name> on the resource path
    config = etree.fromstring((main.parent / "model.config").read_bytes())
    assert [config.findtext(tag) for tag in ("name", "author/name", "license")] == [
        made.NAME,
        "Ada Lovelace",
        "CC-BY-4.0",
    ]
    assert (main.parent / config.findtext("sdf")).is_file()
    assert etree.parse(main).getroot().get("version") == "1.9"


@pytest.mark.parametrize(
    ("physical", "message"),
    [
        ({"inertia_kg_m2": np.diag([1e-5, 1e-5, 3e-5]).tolist()}, "no rigid body has the principal moments"),
        ({"inertia_kg_m2": np.diag([1e-5, -1e-5, 1e-5]).tolist()}, "no rigid body has"),
        ({"inertia_kg_m2": [[1e-4, 5e-5, 0], [0, 1e-4, 0], [0, 0, 1e-4]]}, "not symmetric"),
        ({"mass_kg": {"value": 0.0, "low": 0.0, "high": 0.0, "source": "user"}}, "its mass is 0.0 kg"),
    ],
)
def test_a_body_that_cannot_be_is_refused(physical: dict[str, object], message: str, tmp_path: Path) -> None:
    sound = made.content(tmp_path / "twin")
    fields = {name: Estimate(**value) if isinstance(value, dict) else value for name, value in physical.items()}
    record = sound.record.model_copy(update={"physical": sound.physical.model_copy(update=fields)})
    twin = replace(sound, record=record)
    for name in OURS:
        with pytest.raises(ExportError, match=message):
            exporter(name)(twin)


def test_a_twin_without_hulls_is_refused(tmp_path: Path) -> None:
    folder = made.write_twin(tmp_path / "twin")
    twin = replace(TwinContent.of(Twin(folder)), hulls=())
    for name in OURS:
        with pytest.raises(ExportError, match="no collision hulls"):
            exporter(name)(twin)
    shutil.rmtree(folder / "collision")
    with pytest.raises(TwinError, match=r"collision/hull_00\.obj.* missing"):
        TwinContent.of(Twin(folder))


def test_formats_are_chosen_by_name() -> None:
    assert chosen_formats(["urdf", " MJCF", "urdf"]) == ("mjcf", "urdf")
    assert chosen_formats(["all"]) == chosen_formats(None) == formats()
    with pytest.raises(UsageError, match="did you mean 'urdf'"):
        chosen_formats(["urfd"])
    with pytest.raises(UsageError, match="no format is named"):
        chosen_formats([""])
    with pytest.raises(UsageError, match="unknown format"):
        exporter("stl")


def test_every_format_has_its_notes() -> None:
    assert set(NOTES) == set(formats())
    for name, notes in NOTES.items():
        said = set() if name in ("graspgen", "isaac_grasp") else set(QUANTITIES) - {"frame"}  # those are grasps alone
        assert set(notes.says) == said and notes.load


def test_safe_names_are_left_as_they_are() -> None:
    assert safe_name("meshes/a_00.obj") == "meshes/a_00.obj"
