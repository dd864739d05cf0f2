"""Scenes tell a twin that stands otherwise now from one that was only amended."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from manitwin.cli.main import app
from manitwin.errors import TwinError, UsageError
from manitwin.scenes.changed_twins import CurrentTwinStates, find_changed_twins, require_same_twins
from manitwin.scenes.layouts.layouts_run import make_layouts
from manitwin.scenes.layouts.pool import cached_pool
from manitwin.scenes.scene import SCENE, SceneRecord
from manitwin.scenes.scene_files import read_scene, scene_bytes, scene_files
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.record_digests import body_sha256, twin_state
from manitwin.twin.store import RECORD, canonical_json, read_record, write_twin_record
from scene_twins import slab, write_thing

Amend = Callable[[dict[str, Any], Path], None]


@pytest.fixture
def twins(tmp_path: Path) -> Path:
    for number, thing in enumerate((slab("dice", 0.03, 0.03, 0.03), slab("box", 0.08, 0.06, 0.05))):
        write_thing(tmp_path / "twins", number, thing)
    return tmp_path / "twins"


@pytest.fixture
def scene(twins: Path, tmp_path: Path) -> SceneRecord:
    settings = LayoutsConfig(seed=3, layout=LayoutSettings(objects=(2, 2)))
    report = make_layouts(twins, tmp_path / "scenes", 1, settings, executor="inline")
    assert report.counts["accepted"] == 1 and not report.remarks
    return read_scene(scene_files(tmp_path / "scenes")[0])


def amend(twins: Path, twin_id: str, change: Amend) -> None:
    """Change a twin's record and files, and seal it anew."""
    folder = twins / twin_name(twin_id)
    record = json.loads((folder / RECORD).read_bytes())
    change(record, folder)
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    cached_pool.cache_clear()


def words(record: dict[str, Any], folder: Path) -> None:
    record["language"]["caption"] = "Another caption."


def whose_word(record: dict[str, Any], folder: Path) -> None:
    record["physical"]["mass_kg"]["source"] = "user"


def grasps(record: dict[str, Any], folder: Path) -> None:
    (folder / "grasps.parquet").write_bytes((folder / "grasps.parquet").read_bytes() + b"\0")


def look(record: dict[str, Any], folder: Path) -> None:
    (folder / "visual.glb").write_bytes((folder / "visual.glb").read_bytes() + b"\0")


def mass(record: dict[str, Any], folder: Path) -> None:
    record["physical"]["mass_kg"]["value"] *= 1.2


def friction(record: dict[str, Any], folder: Path) -> None:
    record["physical"]["friction_static"] |= dict.fromkeys(("value", "low", "high"), 0.45)


def hull(record: dict[str, Any], folder: Path) -> None:
    path = folder / "collision/hull_00.obj"
    path.write_text(path.read_text().replace("0.03", "0.031"))


def placement(record: dict[str, Any], folder: Path) -> None:
    record["placements"].reverse()


def rejected(record: dict[str, Any], folder: Path) -> None:
    record["status"] = "rejected"
    record["rejection"] = {"stage": "verify", "reason": "none_held", "detail": "nothing held"}


@pytest.mark.parametrize("change", [words, whose_word, grasps, look])
def test_twin_that_was_amended_still_stands(twins: Path, scene: SceneRecord, change: Amend) -> None:
    first = scene.objects[0]
    amend(twins, first.twin_id, change)
    now, remarks = require_same_twins([scene], TwinSource(twins), "scenes")
    state = now.states[first.twin_id]
    assert state is not None and state.revision != first.revision and state.body_sha256 == first.body_sha256
    assert not remarks


@pytest.mark.parametrize("change", [mass, friction, hull, placement, rejected])
def test_twin_that_stands_otherwise_is_named(twins: Path, scene: SceneRecord, change: Amend, tmp_path: Path) -> None:
    first = scene.objects[0]
    amend(twins, first.twin_id, change)
    expected = (
        rf"scenes: twin {first.twin_id} \({first.category}\) changed in shape, mass, contact or placements since coming to"
        " rest in 1 of 1 scene; sample the layouts again"
    )
    with pytest.raises(UsageError, match=expected):
        require_same_twins([scene], TwinSource(twins), "scenes")
    if change is rejected:
        return
    done = CliRunner().invoke(app, ["export", str(tmp_path / "scenes"), "-o", str(tmp_path / "out"), "--to", "mjcf"])
    assert done.exit_code == 0 and f"twin {first.twin_id}" in " ".join(done.stderr.split())
    settings = LayoutsConfig(seed=3, layout=LayoutSettings(objects=(2, 2)))
    report = make_layouts(twins, tmp_path / "scenes", 1, settings, executor="inline")
    assert any(first.twin_id in remark and "left unchanged" in remark for remark in report.remarks)


def test_scene_of_an_earlier_version_is_read_and_stays_the_same_bytes(scene: SceneRecord, tmp_path: Path) -> None:
    said = json.loads(scene_bytes(scene))
    said["schema_version"] = 1
    for each in said["objects"]:
        assert len(each.pop("body_sha256")) == 64
    (tmp_path / SCENE).write_text(canonical_json(said))
    read = read_scene(tmp_path / SCENE)
    assert [each.body_sha256 for each in read.objects] == [None, None]
    assert scene_bytes(read) == (tmp_path / SCENE).read_bytes(), "tasks name it by its digest"


def test_twins_of_an_earlier_scene_are_told_where_nobody_knows(twins: Path, scene: SceneRecord) -> None:
    earlier = scene.model_copy(
        update={"objects": tuple(each.model_copy(update={"body_sha256": None}) for each in scene.objects)}
    )
    _, remarks = require_same_twins([earlier], TwinSource(twins), "scenes")
    assert not remarks
    amend(twins, scene.objects[0].twin_id, grasps)
    _, (remark,) = require_same_twins([earlier], TwinSource(twins), "scenes")
    assert (
        scene.objects[0].twin_id in remark and "another revision" in remark and scene.objects[1].twin_id not in remark
    )


def test_twin_that_cannot_be_read_is_left_to_what_reads_it(twins: Path, scene: SceneRecord) -> None:
    (twins / twin_name(scene.objects[0].twin_id) / RECORD).write_text("{}")
    now, remarks = require_same_twins([scene], TwinSource(twins), "scenes")
    assert not remarks and list(now.states) == [scene.objects[1].twin_id]


def test_many_twins_are_counted(scene: SceneRecord) -> None:
    first = scene.objects[0]
    objects = tuple(first.model_copy(update={"twin_id": f"twin_{number}"}) for number in range(5))
    found = find_changed_twins([scene.model_copy(update={"objects": objects}), scene], lambda twin_id: None)
    assert len(found.changed) == 7 and found.changed_remark is not None
    assert " and 4 more changed" in found.changed_remark and "2 of 2 scenes" in found.changed_remark


def test_states_are_those_of_the_records(twins: Path, scene: SceneRecord) -> None:
    now = CurrentTwinStates(TwinSource(twins))
    for each in scene.objects:
        record = read_record(twins / twin_name(each.twin_id))
        state = now(each.twin_id)
        assert state is not None
        assert state.revision == record.revision == each.revision
        assert state.body_sha256 == body_sha256(record.model_dump(mode="json")) == each.body_sha256
        assert record.grasps is not None and state.grippers == {record.grasps.gripper: record.grasps.gripper_sha256}


def test_what_is_no_record_says_so() -> None:
    with pytest.raises(TwinError, match=r"a/twin\.json: not a record of a twin.*build the twin again"):
        twin_state({"revision": "x", "placements": [1]}, "a/twin.json")
