from __future__ import annotations

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer import Typer
from typer.testing import CliRunner

from articulated_assets import write_assets
from foreign_assets import mug_urdf
from input_items import collect_items
from manitwin.assets.importers.importer import import_assets
from manitwin.cli.commands.import_ import import_
from manitwin.config import MeshConfig
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.stage import Draft
from manitwin.errors import UsageError
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.packed_source import pack_source
from manitwin.geometry.poses import OBJECT_TO_GLTF
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.mesh import MeshStage
from manitwin.pipeline.object_state import read_given

EARLIER = ("file", "text", "name", "units", "up", "license", "attribution")
"""What an item was before it could be imported, varied or shown by several photos."""


def imported(folder: Path, **mug: float) -> Path:
    (one,) = import_assets([mug_urdf(folder / "in", **mug)], folder / "out")  # type: ignore[arg-type]
    assert one.folder is not None
    return one.folder


def test_imported_folder_is_one_item_in_metres_and_y_up(tmp_path: Path) -> None:
    folder = imported(tmp_path)
    ((item,), _) = collect_items([folder], units="mm", up="z")
    assert item == Item(
        file=str(folder / "asset.glb"),
        name="mug",
        units="m",
        up="y",
        license="CC0-1.0",
        given=str(folder / "import.json"),
    )
    ((named,), _) = collect_items([folder], name="cup", license="MIT")
    assert (named.name, named.license) == ("cup", "MIT")


def test_a_stated_longest_side_counts(tmp_path: Path) -> None:
    """A cylinder whose file has centimetres for metres, lying, so that it is also turned."""
    shape = '<origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.0003" length="0.002"/></geometry>'
    (tmp_path / "bottle.urdf").write_text(
        f'<robot name="bottle"><link name="a"><visual>{shape}</visual></link></robot>'
    )
    (one,) = import_assets([tmp_path / "bottle.urdf"], tmp_path / "imported")
    assert one.folder is not None, one.error
    ((item,), _) = collect_items([one.folder], longest_side_m=0.2)
    assert (item.units, item.longest_side_m) == ("m", 0.2)
    geometry = MeshStage(MeshConfig()).run(Draft("id", item, 0), tmp_path)["geometry"]
    with np.load(tmp_path / "canonical.npz") as solid:
        low, high = solid["vertices"].min(axis=0), solid["vertices"].max(axis=0)
    assert (high - low).tolist() == pytest.approx([0.06, 0.06, 0.2], abs=1e-3)
    (mesh,) = read_mesh(one.folder / "asset.glb").parts
    moved = trimesh.transform_points(mesh.vertices, np.array(geometry["input_to_object"]))
    assert np.allclose([moved.min(axis=0), moved.max(axis=0)], [low, high], atol=1e-6), "what is given follows the mesh"


def test_what_an_asset_gives_grows_to_the_longest_side_that_is_stated(tmp_path: Path) -> None:
    """A chest of drawers whose lengths are too short: masses stay, and neither an axis nor a turn is scaled."""
    (tmp_path / "in").mkdir()
    (one,) = import_assets([write_assets(tmp_path / "in")["drawers"]], tmp_path / "out")
    assert one.folder is not None and one.record is not None, one.error
    given = []
    for longest_side_m in (None, 0.9):
        ((item,), _) = collect_items([one.folder], longest_side_m=longest_side_m)
        draft = Draft("id", item, 0)
        draft.fields |= MeshStage(MeshConfig()).run(draft, tmp_path)
        with np.load(tmp_path / "canonical.npz") as solid:
            longest_m = float(np.ptp(solid["vertices"], axis=0).max())
        found = read_given(draft)
        assert found is not None and found.articulation is not None
        given.append((longest_m, found, found.articulation))
    (was_m, before, stood), (is_m, after, moves) = given
    factor = is_m / was_m
    assert is_m == pytest.approx(0.9) and factor > 1.5
    for old, new in zip(stood.joints, moves.joints, strict=True):
        assert np.allclose(new.axis, old.axis)
        assert np.allclose(new.origin_m, factor * np.array(old.origin_m))
        assert old.type == "prismatic" and old.upper is not None and new.upper == pytest.approx(factor * old.upper)
    for old_link, new_link in zip(stood.links, moves.links, strict=True):
        assert new_link.mass_kg == old_link.mass_kg
        assert np.allclose(new_link.inertia_kg_m2, factor**2 * np.array(old_link.inertia_kg_m2), rtol=1e-6, atol=0)
    assert after.mass_kg == before.mass_kg is not None
    assert np.allclose(after.center_of_mass_m, factor * np.array(before.center_of_mass_m), atol=1e-9)
    assert np.allclose(after.inertia_kg_m2, factor**2 * np.array(before.inertia_kg_m2), rtol=1e-6, atol=1e-12)


def test_folder_of_imported_assets_and_meshes_gives_each_once(tmp_path: Path) -> None:
    folder = imported(tmp_path)
    (folder.parent / "other.stl").write_bytes(b"solid x\nendsolid x\n")
    items, _ = collect_items([folder.parent])
    assert [Path(item.file or "").name for item in items] == ["asset.glb", "other.stl"]
    assert [item.given is not None for item in items] == [True, False]


def test_manifest_may_name_an_imported_folder(tmp_path: Path) -> None:
    folder = imported(tmp_path)
    (tmp_path / "list.jsonl").write_text(json.dumps({"file": "out/mug", "name": "beer mug"}) + "\n")
    ((item,), _) = collect_items([tmp_path / "list.jsonl"])
    assert item.given == str(folder / "import.json") and item.name == "beer mug"


def test_what_is_given_is_part_of_the_identity_and_only_there(tmp_path: Path) -> None:
    folder = imported(tmp_path)
    ((item,), _) = collect_items([folder])
    before = twin_id(item)
    plain = dataclasses.replace(item, given=None)
    mesh_alone = twin_id(plain)
    record = json.loads((folder / "import.json").read_text())
    (folder / "import.json").write_text(json.dumps(record | {"mass_kg": 0.5}))
    assert len({before, twin_id(item), mesh_alone}) == 3
    assert twin_id(plain) == mesh_alone


def test_ledger_of_before_knows_its_items_again(tmp_path: Path) -> None:
    item = Item(file="/data/mug.glb", name="mug")
    ledger = Ledger(tmp_path / "ledger.sqlite")
    fields = {name: value for name, value in dataclasses.asdict(item).items() if name in EARLIER}
    ledger.connection.execute("INSERT INTO items (item) VALUES (?)", (json.dumps(fields, sort_keys=True),))
    ledger.add_items([item, dataclasses.replace(item, given="/data/import.json")])
    assert [Item.from_json(open_item.payload) for open_item in ledger.next_open(0, 10)] == [
        item,
        dataclasses.replace(item, given="/data/import.json"),
    ]
    ledger.close()


def test_source_of_an_imported_twin_has_what_was_given(tmp_path: Path) -> None:
    folder, kept = imported(tmp_path), tmp_path / "kept"
    kept.mkdir()
    name, _ = pack_source(folder / "asset.glb", kept, [folder / "import.json"])
    assert name == "source.zip" and b"import.json" in (kept / name).read_bytes()
    assert pack_source(folder / "asset.glb", kept)[0] == "source.glb"
    assert (kept / "source.glb").read_bytes() == (folder / "asset.glb").read_bytes()


def test_broken_import_record_is_a_usage_error(tmp_path: Path) -> None:
    folder = imported(tmp_path)
    (folder / "import.json").write_text("{")
    with pytest.raises(UsageError, match=r"import\.json"):
        collect_items([folder])


def test_command_prints_one_line_an_asset(tmp_path: Path) -> None:
    app = Typer()
    app.command()(import_)
    path = mug_urdf(tmp_path / "in", mass_kg=0.32)
    done = CliRunner().invoke(app, [str(path), "-o", str(tmp_path / "out"), "--from", "urdf"])
    assert done.exit_code == 0, done.output
    said = " ".join(done.output.split())
    kept = "mass 0.32 kg, centre of mass, inertia, friction 0.55, dynamic friction 0.55"
    assert f"mug: urdf; kept {kept}; missing restitution" in said
    assert "dropped 1 collision shape: a build makes and checks its own" in said
    assert "1 imported, 0 not" in said
    again = CliRunner().invoke(app, [str(path), "-o", str(tmp_path / "out")])
    assert again.exit_code == 0 and "mug: already imported, left unchanged" in again.output
    assert "0 imported, 1 already imported, 0 not" in " ".join(again.output.split())
    shutil.copytree(tmp_path / "in", tmp_path / "twice" / "copy")
    shutil.copytree(tmp_path / "in", tmp_path / "twice" / "own")
    twice = " ".join(CliRunner().invoke(app, [str(tmp_path / "twice"), "-o", str(tmp_path / "new")]).output.split())
    assert "is a duplicate of" in twice and "1 imported, 1 duplicate, 0 not" in twice
    broken = CliRunner().invoke(app, [str(path), "-o", str(tmp_path / "out"), "--from", "urd"])
    assert isinstance(broken.exception, UsageError) and "did you mean 'urdf'" in str(broken.exception)


@pytest.mark.parametrize(("name", "height_m"), [("bottle", 0.2), ("foam brick", 0.06)])
def test_a_vessel_that_lies_in_its_world_is_stood_up_with_what_is_given_of_it(
    tmp_path: Path, name: str, height_m: float
) -> None:
    shape = '<origin xyz="0 0 0.03" rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.03" length="0.2"/></geometry>'
    inertia = '<inertia ixx="1e-3" iyy="2e-4" izz="1e-3" ixy="0" ixz="0" iyz="0"/>'
    inertial = f'<inertial><origin xyz="0 0.05 0.03"/><mass value="0.4"/>{inertia}</inertial>'
    (tmp_path / "thing.urdf").write_text(
        f'<robot name="{name}"><link name="a">{inertial}<visual>{shape}</visual></link></robot>'
    )
    (one,) = import_assets([tmp_path / "thing.urdf"], tmp_path / "imported")
    assert one.folder is not None and one.record is not None and one.record.center_of_mass_m is not None, one.error
    given = one.folder / "import.json"
    item = Item(str(one.folder / "asset.glb"), name=name, units="m", up="y", given=str(given))
    geometry = MeshStage(MeshConfig()).run(Draft("id", item, 0), tmp_path)["geometry"]
    with np.load(tmp_path / "canonical.npz") as solid:
        assert np.ptp(solid["vertices"][:, 2]) == pytest.approx(height_m, abs=1e-3)
    moved = one.record.moved(np.array(geometry["input_to_object"]) @ OBJECT_TO_GLTF)
    assert moved.center_of_mass_m is not None
    assert abs(moved.center_of_mass_m[2] - height_m / 2) == pytest.approx(0.05 if name == "bottle" else 0.0, abs=1e-3)
