from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from articulated_assets import LIDDED_BOX
from foreign_assets import embodiedgen, gso, manitwin100k, mug_urdf
from handmade import mug
from manitwin.assets.importers.importer import import_assets
from manitwin.assets.read import read_asset
from manitwin.cli.main import app
from manitwin.errors import AssetError, UsageError
from manitwin.formats.glb import read_glb
from manitwin.formats.meshes.textures import material_of
from manitwin.twin.import_record import ImportRecord, read_import_record
from twin_folders import write_accepted


def imported(path: Path, out: Path, format: str = "auto") -> tuple[ImportRecord, Path]:
    """Import one asset; returns the record as written and its folder."""
    (one,) = import_assets([path], out, format=format)  # type: ignore[arg-type]
    assert one.error is None and one.folder is not None
    return read_import_record(one.folder / "import.json"), one.folder


def test_urdf_is_brought_to_the_object_frame(tmp_path: Path) -> None:
    record, folder = imported(mug_urdf(tmp_path / "in"), tmp_path / "out")
    parts = read_glb(folder / "asset.glb")
    assert np.allclose(parts[0].bounds, _centred(mug().bounds), atol=1e-6)
    shift = -mug().bounds.mean(0)[0]  # the handle moves the box's centre off the axis
    assert record.mass_kg == 0.32 and record.friction_static == record.friction_dynamic == 0.55
    assert np.allclose(record.center_of_mass_m, [0.005 + shift, 0, 0.045], atol=1e-9)
    assert np.allclose(record.inertia_kg_m2, np.diag([5e-4, 5e-4, 4e-4]))
    assert np.allclose(np.array(record.asset_to_object)[:3, 3], [shift - 0.5, 0, -0.2])
    assert record.license == "CC0-1.0" and record.name == "mug"
    assert {"captions", "functional points", "grasp points", "grasps", "category"} <= set(record.missing)
    assert "mass" not in record.missing and "friction" not in record.missing


def test_a_mesh_above_the_file_is_read_below_the_root_that_is_named(tmp_path: Path) -> None:
    """``thing/urdf/mug.urdf`` beside ``thing/mesh/mug.stl``, with nothing that says that these are one package."""
    thing = tmp_path / "thing"
    file = mug_urdf(thing / "urdf")
    (thing / "mesh").mkdir()
    (thing / "urdf" / "mug.stl").rename(thing / "mesh" / "mug.stl")
    file.write_text(file.read_text().replace('filename="mug.stl"', 'filename="../mesh/mug.stl"'))
    (refused,) = import_assets([file], tmp_path / "out")
    assert refused.folder is None and "missing" not in str(refused.error)
    assert f"lies outside the folder above which nothing is read, {thing / 'urdf'}" in str(refused.error)
    assert str(refused.error).endswith(f"import with --root {thing})")
    (taken,) = import_assets([file], tmp_path / "out", root=thing)
    assert taken.record is not None and taken.record.mass_kg == 0.32
    for wrong in (tmp_path / "elsewhere", thing / "mesh", file):
        with pytest.raises(UsageError, match="not below the root"):
            list(import_assets([file], tmp_path / "out", root=wrong))


def test_a_file_of_the_whole_home_is_not_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    file = tmp_path / "downloads" / "mug.urdf"
    file.parent.mkdir()
    mesh = '<visual><geometry><mesh filename="../meshes/mug.obj"/></geometry></visual>'
    file.write_text(f'<robot name="mug"><link name="l">{mesh}</link></robot>')
    (remark,) = [each for each in read_asset(file).remarks if "lies outside" in each]
    assert remark.endswith("; put it there, and its path into the asset's file") and "--root" not in remark


def test_another_asset_of_the_same_name_gets_that_of_its_file_too(tmp_path: Path) -> None:
    for place, side in (("red/cup.urdf", 0.1), ("red/small_cup.urdf", 0.05), ("blue/cup.urdf", 0.2)):
        path = tmp_path / "in" / place
        path.parent.mkdir(parents=True, exist_ok=True)
        box = f'<visual><geometry><box size="{side} {side} {side}"/></geometry></visual>'
        path.write_text(f'<robot name="TeaCup"><link name="l">{box}</link></robot>')
    for again in (False, True):
        found = list(import_assets([tmp_path / "in"], tmp_path / "out"))
        assert [one.there_already for one in found] == [again] * 3
        names = {one.path.relative_to(tmp_path / "in").as_posix(): one.folder.name for one in found if one.folder}
        assert names["blue/cup.urdf"] == "tea_cup" and names["red/small_cup.urdf"] == "tea_cup_small_cup"
        assert names["red/cup.urdf"] == "tea_cup_cup"
    record = read_import_record(tmp_path / "out" / "tea_cup" / "import.json")
    assert record.name == "Tea Cup", "which priors know"


@pytest.mark.parametrize("fast", ["1", "0"])
def test_what_stands_fast_in_its_file_is_said_to(tmp_path: Path, fast: str) -> None:
    shape = '<visual name="v"><geometry><box><size>0.1 0.1 0.1</size></box></geometry></visual>'
    (tmp_path / "shelf.sdf").write_text(
        f'<sdf version="1.9"><model name="shelf"><static>{fast}</static><link name="l">{shape}</link></model></sdf>'
    )
    record, _ = imported(tmp_path / "shelf.sdf", tmp_path / "out")
    assert any("stands fast" in remark for remark in record.remarks) == (fast == "1")


def _centred(bounds: np.ndarray) -> np.ndarray:
    middle = bounds.mean(0)
    return bounds - [middle[0], middle[1], bounds[0, 2]]


def test_same_asset_gives_the_same_bytes(tmp_path: Path) -> None:
    path = mug_urdf(tmp_path / "in")
    _, first = imported(path, tmp_path / "a")
    _, second = imported(path, tmp_path / "b")
    for name in ("asset.glb", "import.json"):
        assert (first / name).read_bytes() == (second / name).read_bytes()


@pytest.mark.parametrize("mass_kg", [0.0, -1.0])
def test_mass_that_cannot_be_is_missing_with_what_was_declared(tmp_path: Path, mass_kg: float) -> None:
    record, _ = imported(mug_urdf(tmp_path / "in", mass_kg=mass_kg), tmp_path / "out")
    assert record.mass_kg is None and f"mass (declared as {mass_kg:g})" in record.missing


def test_twin_comes_back_with_everything(tmp_path: Path) -> None:
    write_accepted(tmp_path / "twins", 1, mass_kg=0.42)
    record, _ = imported(tmp_path / "twins", tmp_path / "out")
    assert record.format == "twin" and record.mass_kg == 0.42 and record.category == "mug"
    assert record.functional_points and record.grasp_points and record.grasps and record.rests and record.captions
    assert np.allclose(record.asset_to_object, np.eye(4), atol=1e-6)
    assert [what for what in record.missing if what not in ("collision shapes", "licence")] == []


def test_manitwin100k_is_taken_over(tmp_path: Path) -> None:
    record, folder = imported(manitwin100k(tmp_path / "mug" / "002"), tmp_path / "out")
    assert (record.format, record.category, record.name) == ("manitwin100k", "mug", "mug")
    assert record.captions == ["a red mug with one round handle"]
    assert np.allclose(read_glb(folder / "asset.glb")[0].bounds, _centred(mug().bounds), atol=1e-6)
    assert np.allclose(np.array(record.rests[0])[:3, :3], np.eye(3), atol=1e-9)
    assert record.remarks == [] and "mass" in record.missing


def test_place_off_the_lowest_point_is_repaired_and_said(tmp_path: Path) -> None:
    record, folder = imported(manitwin100k(tmp_path / "mug" / "002", place_off_m=0.012), tmp_path / "out")
    points = np.concatenate([part.vertices for part in read_glb(folder / "asset.glb")])
    rest = np.array(record.rests[0])
    assert (points @ rest[:3, :3].T + rest[:3, 3])[:, 2].min() == pytest.approx(0, abs=1e-6)
    assert any("12.0 mm below" in remark for remark in record.remarks)


def test_manitwin100k_box_that_is_not_the_meshs_is_said(tmp_path: Path) -> None:
    box = {"bounding_box": {"min_bounds": [-1, 0, -1], "max_bounds": [1, 1, 1]}}
    record, _ = imported(manitwin100k(tmp_path / "mug" / "002", annotations=box), tmp_path / "out")
    assert any("bounding box is" in remark for remark in record.remarks)


def test_annotations_in_z_up_axes_are_recognised_by_the_box(tmp_path: Path) -> None:
    low, high = mug().bounds
    z_up = {
        "bounding_box": {"min_bounds": low.tolist(), "max_bounds": high.tolist()},
        "active": {"place": {"id_0": {"position": [0, 0, 0], "rotation": [0, 0, 1], "face": "-z"}}},
    }
    record, _ = imported(manitwin100k(tmp_path / "mug" / "002", annotations=z_up), tmp_path / "out")
    assert record.remarks == [] and np.allclose(np.array(record.rests[0])[:3, :3], np.eye(3), atol=1e-9)


def test_successor_fields_are_read_and_unknown_ones_named(tmp_path: Path) -> None:
    more = {
        "active": {
            "place": {"up": {"projection_circle": {"center": [0, 0, 0, 0.5**0.5, -(0.5**0.5), 0, 0], "radius": 0.06}}}
        },
        "physics": {"mass": 0.3, "static_friction": 0.6, "dynamic_friction": 1.5, "restitution": 0.1},
        "grasps": {"left": []},
    }
    record, _ = imported(manitwin100k(tmp_path / "mug" / "002", annotations=more), tmp_path / "out")
    assert record.mass_kg == 0.3 and record.friction_static == 0.6 and record.restitution == 0.1
    assert record.friction_dynamic is None  # nothing slides harder than it sticks
    assert any("above the static 0.6" in what for what in record.missing)
    assert any("'grasps' was not read" in remark for remark in record.remarks)
    assert np.allclose(np.array(record.rests[0])[:3, 2], [0, 0, 1], atol=1e-9)  # Rx(-90) brings Y-up's +Y to its Z


@pytest.mark.parametrize(
    "more",
    [
        {"bounding_box": {"min_bounds": [float("nan"), 0, 0], "max_bounds": [1, 1, 1]}},
        {"physics": {"mass": 1e300}},
        {"physics": ["mass"]},
        {"active": {"place": {"id_0": {"position": [0, 0], "rotation": [0, 1, 0]}}}},
        {"active": {"place": {"id_0": {"position": [0, 0, 0], "rotation": [0, 0, 0]}}}},
        {"active": {"place": {str(i): {} for i in range(2000)}}},
    ],
)
def test_broken_annotations_are_an_error_in_one_line(tmp_path: Path, more: dict[str, object]) -> None:
    folder = manitwin100k(tmp_path / "mug" / "002", annotations=more)
    with pytest.raises(AssetError) as caught:
        read_asset(folder)
    assert "\n" not in str(caught.value)


def test_scan_finds_its_texture_and_its_collections_licence(tmp_path: Path) -> None:
    record, folder = imported(gso(tmp_path / "Tall_Box"), tmp_path / "out")
    part = read_glb(folder / "asset.glb")[0]
    texture = material_of(part).baseColorTexture
    assert isinstance(texture, Image.Image) and np.allclose(texture.getpixel((4, 4)), (1, 150, 30), atol=4)
    assert np.allclose(part.bounds, [[-0.05, -0.1, 0], [0.05, 0.1, 0.3]], atol=1e-6)
    assert record.license == "CC-BY-4.0" and record.category == "Bottles and Cans"
    assert "mass" in record.missing and not any(what.startswith("file ") for what in record.missing)


def test_embodiedgen_says_what_its_annotator_said(tmp_path: Path) -> None:
    record, folder = imported(embodiedgen(tmp_path / "mug"), tmp_path / "out")
    assert record.format == "embodiedgen" and record.category == "mug"
    assert record.mass_kg == 0.3 and (record.friction_static, record.friction_dynamic) == (0.7, 0.5)
    assert record.captions == ["a mug with one handle"]
    assert any("mass 0.25 to 0.35 kg" in remark for remark in record.remarks)
    assert any("MeshGeoChecker said YES" in remark for remark in record.remarks)
    assert np.allclose(read_glb(folder / "asset.glb")[0].bounds, _centred(mug().bounds), atol=1e-5)


def test_embodiedgen_without_an_answer_or_a_turn_is_seen(tmp_path: Path) -> None:
    record, folder = imported(embodiedgen(tmp_path / "mug", turned=False, failed=True), tmp_path / "out")
    assert any("did not answer" in remark for remark in record.remarks)
    assert any("real_height says 1 m" in remark for remark in record.remarks)
    assert np.allclose(read_glb(folder / "asset.glb")[0].bounds, _centred(mug().bounds), atol=1e-5)


def test_one_bad_asset_does_not_stop_the_others(tmp_path: Path) -> None:
    mug_urdf(tmp_path / "in" / "a")
    (tmp_path / "in" / "bad.urdf").write_text("<robot name='x'/>")
    (tmp_path / "in" / "empty.urdf").write_text(
        "<robot name='x'><link name='l'><visual><geometry><mesh filename='../x.stl'/></geometry></visual></link></robot>"
    )
    results = list(import_assets([tmp_path / "in"], tmp_path / "out"))
    assert [r.folder.name for r in results if r.folder] == ["mug"]
    assert [r.path.name for r in results if r.error] == ["bad.urdf", "empty.urdf"]
    assert "../x.stl lies outside" in str(results[1].error)


def test_another_asset_of_the_same_name_is_written_beside_the_first(tmp_path: Path) -> None:
    (light,) = import_assets([mug_urdf(tmp_path / "a", mass_kg=0.2)], tmp_path / "out")
    (heavy,) = import_assets([mug_urdf(tmp_path / "b", mass_kg=0.4)], tmp_path / "out")
    assert light.folder is not None and heavy.folder is not None and heavy.folder != light.folder
    assert [read_import_record(f / "import.json").mass_kg for f in (light.folder, heavy.folder)] == [0.2, 0.4]
    assert re.fullmatch("mug_[0-9a-f]{8}", heavy.folder.name)
    both = list(import_assets([tmp_path / "a", tmp_path / "b"], tmp_path / "other"))
    assert [one.folder and one.folder.name for one in both] == ["mug", heavy.folder.name]  # whatever was there before


def test_the_same_asset_imported_again_is_recognised_and_left_as_it_is(tmp_path: Path) -> None:
    paths = [mug_urdf(tmp_path / "a", mass_kg=0.2), mug_urdf(tmp_path / "b", mass_kg=0.4)]
    first = list(import_assets(paths, tmp_path / "out"))
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*")}
    again = list(import_assets(reversed(paths), tmp_path / "out"))
    assert [one.there_already for one in (*first, *again)] == [False, False, True, True]
    assert [one.folder for one in again] == [one.folder for one in reversed(first)]
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*")} == before


def test_an_import_that_was_changed_by_hand_is_not_written_over(tmp_path: Path) -> None:
    _, folder = imported(mug_urdf(tmp_path / "in"), tmp_path / "out")
    changed = (folder / "import.json").read_text().replace('"mug"', '"my mug"')
    (folder / "import.json").write_text(changed)
    _, other = imported(mug_urdf(tmp_path / "in"), tmp_path / "out")
    assert other != folder and (folder / "import.json").read_text() == changed
    (other / "import.json").write_text(changed)
    with pytest.raises(UsageError, match="changed since"):
        list(import_assets([mug_urdf(tmp_path / "in")], tmp_path / "out"))


def test_folder_of_something_else_is_not_written_over(tmp_path: Path) -> None:
    (tmp_path / "out" / "mug").mkdir(parents=True)
    with pytest.raises(UsageError, match="no imported asset"):
        list(import_assets([mug_urdf(tmp_path / "in")], tmp_path / "out"))


def test_import_record_that_was_broken_is_one_line(tmp_path: Path) -> None:
    _, folder = imported(mug_urdf(tmp_path / "in"), tmp_path / "out")
    record = json.loads((folder / "import.json").read_text())
    (folder / "import.json").write_text(json.dumps(record | {"mass_kg": -1}))
    with pytest.raises(UsageError, match=r"import\.json: mass_kg"):
        read_import_record(folder / "import.json")


def test_mass_properties_that_no_body_has_are_dropped_with_the_reason(tmp_path: Path) -> None:
    def told(inertial: str) -> ImportRecord:
        path = mug_urdf(tmp_path / "in", mass_kg=0.32)
        head, rest = path.read_text().split("<inertial>")
        path.write_text(f"{head}<inertial>{inertial}</inertial>{rest.split('</inertial>')[1]}")
        return imported(path, tmp_path / "out")[0]

    tensor = '<inertia ixx="{}" ixy="0" ixz="0" iyy="{}" iyz="0" izz="{}"/>'
    inside, outside = '<origin xyz="0.505 0 0.245"/><mass value="0.32"/>', '<origin xyz="3 0 0"/><mass value="0.32"/>'
    for wrong, why in (
        (tensor.format("5e-4", "5e-4", "4e-3"), "inertia: principal moments"),
        (tensor.format("-5e-4", "5e-4", "4e-4"), "inertia: the inertia is not positive definite"),
        (tensor.format("1.0", "1.0", "1.0"), "inertia: the inertia is the template's constant"),
    ):
        record = told(inside + wrong)
        assert record.inertia_kg_m2 is None and record.center_of_mass_m is not None
        assert any(reason.startswith(why) for reason in record.dropped), record.dropped
        assert "inertia" not in record.missing
    record = told(outside + tensor.format("5e-4", "5e-4", "4e-4"))
    assert record.center_of_mass_m is None and any("outside the object's convex hull" in d for d in record.dropped)
    assert told(inside + tensor.format("5e-4", "5e-4", "4e-4")).dropped == [
        "1 collision shape: a build makes and checks its own"
    ]


def test_report_has_what_was_kept_and_dropped_of_each_and_why_one_failed(tmp_path: Path) -> None:
    mug_urdf(tmp_path / "in" / "a", mass_kg=0.0)
    (tmp_path / "in" / "bad.urdf").write_text("<robot name='x'/>")
    words = ["import", str(tmp_path / "in"), "-o", str(tmp_path / "out"), "--report", str(tmp_path / "report.json")]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 3, done.output
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["summary"] == {"imported": 1, "imported_before": 0, "not_imported": 1}
    bad, mug_entry = report["assets"]
    assert mug_entry["folder"] == "mug" and "centre of mass" in mug_entry["kept"]
    assert "mass: 0 is none that an object can have" in mug_entry["dropped"]
    assert bad["folder"] is None and "no <link>" in bad["error"]
    refused = CliRunner().invoke(app, [*words[:-1], str(tmp_path / "no" / "report.json")])
    assert "cannot be written" in str(refused.exception)


def test_a_mass_of_less_than_the_air_within_is_a_placeholder(tmp_path: Path) -> None:
    record, _ = imported(mug_urdf(tmp_path / "in", mass_kg=1e-9), tmp_path / "out")
    assert (record.mass_kg, record.center_of_mass_m, record.inertia_kg_m2) == (None, None, None)
    assert any(why.startswith("mass, centre of mass and inertia: 1e-09 kg in a hull of") for why in record.dropped)
    light, _ = imported(mug_urdf(tmp_path / "light", mass_kg=0.016), tmp_path / "out")
    assert light.mass_kg == 0.016, "wrong, and still what somebody says"


def test_a_links_inertia_beyond_its_size_is_not_kept_and_its_mass_is(tmp_path: Path) -> None:
    lid = LIDDED_BOX[LIDDED_BOX.index('<link name="lid"') :]
    text = LIDDED_BOX.replace(lid, re.sub(r'i(xx|yy|zz)="[^"]*"', r'i\1="0.16"', lid, count=3))
    (tmp_path / "box.urdf").write_text(text)
    record, _ = imported(tmp_path / "box.urdf", tmp_path / "out")
    assert record.articulation is not None
    body, lid_ = record.articulation.links
    assert body.inertia_kg_m2 is not None
    assert lid_.inertia_kg_m2 is None and lid_.mass_kg is not None and lid_.center_of_mass_m is not None
    assert any(why.startswith("inertia of link 'lid': 0.16 kg m2 about an axis, but") for why in record.dropped)
    turned = record.articulation.moved(np.diag([-1.0, -1.0, 1.0, 1.0])).links[1]
    assert turned.center_of_mass_m == pytest.approx(np.array([-1, -1, 1]) * lid_.center_of_mass_m)


def test_each_object_of_an_mjcf_scene_is_an_asset_with_its_own_name_and_mass(tmp_path: Path) -> None:
    bodies = "".join(
        f'<body{name} pos="{x} 0 1"><freejoint/><geom type="mesh" mesh="{mesh}" mass="{kg}"/></body>'
        for name, x, mesh, kg in (
            (' name="sugar box"', 0, "look", 0.514),
            ("", 1, "012_mug", 0.118),
            ("", 2, "012_mug", 0.3),
        )
    )
    mug().export(tmp_path / "012_mug.stl")
    (tmp_path / "scene.xml").write_text(
        '<mujoco model="shelf"><asset><mesh name="look" file="012_mug.stl" scale="1 1 2"/><mesh file="012_mug.stl"/></asset>'
        f'<worldbody><geom type="plane" size="1 1 1"/><body name="table"><geom type="box" size="1 1 0.1"/></body>{bodies}'
        "</worldbody></mujoco>"
    )
    (first,) = import_assets([tmp_path / "scene.xml"], tmp_path / "first")
    assert first.record is not None and first.record.mass_kg == 0.514
    assert any("2 more bodies" in remark or "moves by itself" in remark for remark in first.record.remarks)
    every = list(import_assets([tmp_path / "scene.xml"], tmp_path / "each", each_object=True))
    told = [(one.folder.name.split("_")[0], one.record.mass_kg) for one in every if one.folder and one.record]
    assert told == [("sugar", 0.514), ("mug", 0.118), ("mug", 0.3)]
    assert len({one.folder for one in every}) == 3
    assert not any("moves by itself" in remark for one in every if one.record for remark in one.record.remarks)
    (alone,) = import_assets([mug_urdf(tmp_path / "urdf")], tmp_path / "each", each_object=True)
    assert alone.record is not None and alone.record.mass_kg == 0.32, "another format is read as ever"
    said = CliRunner().invoke(app, ["import", str(tmp_path / "scene.xml"), "-o", str(tmp_path / "said")])
    assert "--each-object imports all of them" in said.output
    with pytest.raises(AssetError, match="3 of its objects are free to move; there is no number 3"):
        read_asset(tmp_path / "scene.xml", number=3)


def test_a_box_of_a_description_has_edges(tmp_path: Path) -> None:
    box = '<visual><geometry><box size="0.1 0.2 0.3"/></geometry></visual>'
    (tmp_path / "block.urdf").write_text(f'<robot name="block"><link name="l">{box}</link></robot>')
    _, folder = imported(tmp_path / "block.urdf", tmp_path / "out")
    (part,) = read_glb(folder / "asset.glb")
    solid = part.faces[part.area_faces > 0]  # the others close seams
    across = np.cross(*np.moveaxis(np.diff(part.vertices[solid], axis=1), 1, 0))
    across /= np.linalg.norm(across, axis=1)[:, None]
    assert np.allclose(part.vertex_normals[solid], across[:, None], atol=1e-4)


def test_a_centre_of_mass_that_a_build_refuses_is_not_kept(tmp_path: Path) -> None:
    box = '<visual><geometry><box size="0.1 0.1 0.02"/></geometry></visual>'
    for z, kept in ((0.0099, True), (0.01005, True), (0.0104, False)):
        mass = f'<inertial><origin xyz="0 0 {z}"/><mass value="0.1"/></inertial>'
        (tmp_path / "tile.urdf").write_text(f'<robot name="tile"><link name="l">{mass}{box}</link></robot>')
        record, _ = imported(tmp_path / "tile.urdf", tmp_path / f"out_{z}")
        assert (record.center_of_mass_m is not None) == kept
        assert any("0.4 mm outside of what is seen" in why for why in record.dropped) != kept


def test_a_mesh_of_another_model_is_asked_for_with_the_folder_that_holds_it(tmp_path: Path) -> None:
    seen = '<visual name="v"><geometry><mesh><uri>model://digit/meshes/digit.stl</uri></mesh></geometry></visual>'
    two = tmp_path / "models" / "two"
    two.mkdir(parents=True)
    (two / "model.sdf").write_text(f'<sdf version="1.6"><model name="two"><link name="l">{seen}</link></model></sdf>')
    (two / "model.config").write_text("<model><name>two</name></model>")
    (alone,) = import_assets([two], tmp_path / "out")
    assert alone.error == (
        "two: no visual mesh to make a twin of (model://digit/meshes/digit.stl is missing);"
        " give the folder that holds 'digit' too"
    )
    (tmp_path / "models/digit/meshes").mkdir(parents=True)
    mug().export(tmp_path / "models/digit/meshes/digit.stl")
    (together,) = import_assets([tmp_path / "models"], tmp_path / "out")
    assert together.error is None


@pytest.mark.parametrize(
    ("mass", "why"), [('<mass value="0"/>', "it is that of 0 kg"), ("", "there is no mass that it is of")]
)
def test_an_inertia_is_not_kept_without_a_mass(tmp_path: Path, mass: str, why: str) -> None:
    """A body of 0 kg is PyBullet's for what is fixed, and its inertia a template's."""
    said = f'<inertial>{mass}<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    box = '<visual><geometry><box size="0.1 0.1 0.02"/></geometry></visual>'
    (tmp_path / "tray.urdf").write_text(f'<robot name="tray"><link name="l">{said}{box}</link></robot>')
    record, _ = imported(tmp_path / "tray.urdf", tmp_path / "out")
    assert record.inertia_kg_m2 is None and record.mass_kg is None
    assert f"inertia: {why}" in record.dropped


def test_the_package_around_an_asset_is_named_where_its_meshes_are_not_there(tmp_path: Path) -> None:
    """A package may be called otherwise than its folder, which a person cannot know from the name that is missing."""
    seen = '<visual><geometry><mesh filename="package://shop_models/cups/cup.stl"/></geometry></visual>'
    folder = tmp_path / "models" / "cups"
    folder.mkdir(parents=True)
    (tmp_path / "models" / "package.xml").write_text("<package><name>shop_models</name></package>")
    (folder / "cup.urdf").write_text(f'<robot name="cup"><link name="l">{seen}</link></robot>')
    (one,) = import_assets([folder], tmp_path / "out")
    assert one.error is not None
    assert one.error.endswith(
        f"give the folder that holds 'shop_models' too; the package around it is {(tmp_path / 'models').resolve()}"
    )


@pytest.mark.parametrize(
    ("name", "told"), [("duck_vhacd", "duck"), ("003_cracker_box_textured", "cracker box"), ("vhacd", "vhacd")]
)
def test_the_names_of_tools_are_no_part_of_a_name(tmp_path: Path, name: str, told: str) -> None:
    box = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
    (tmp_path / "thing.urdf").write_text(f'<robot name="{name}"><link name="l">{box}</link></robot>')
    assert imported(tmp_path / "thing.urdf", tmp_path / "out")[0].name == told
