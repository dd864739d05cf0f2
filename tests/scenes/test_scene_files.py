from __future__ import annotations

import json
from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.scenes.layouts.sample import sample_layout
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_files import read_scene, scene_bytes, write_scene
from manitwin.scenes.settings import LayoutSettings
from scene_twins import pool_of_things


def test_scene_comes_back_as_it_was(tmp_path: Path) -> None:
    record = sample_layout(pool_of_things(), LayoutSettings(objects=(2, 2)), 3, 1)
    path = write_scene(record, tmp_path / "new" / "scene")
    assert read_scene(path) == read_scene(path.parent) == record
    said = json.loads((tmp_path / "new" / "scene" / "scene.json").read_bytes())
    assert [each["position_m"] for each in said["objects"]] == [list(each.position_m) for each in record.objects]
    assert [each["twin_id"] for each in said["objects"]] == [each.twin_id for each in record.objects]
    assert scene_bytes(read_scene(path)) == path.read_bytes()
    assert list(path.parent.iterdir()) == [path]


def test_what_is_no_scene_says_so(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"no scene\.json"):
        read_scene(tmp_path)
    (tmp_path / SCENE).write_text("{")
    with pytest.raises(UsageError, match="its JSON is broken"):
        read_scene(tmp_path)
    (tmp_path / SCENE).write_text(json.dumps({"schema_version": 99}))
    with pytest.raises(UsageError, match="of schema 99, this version reads up to 2"):
        read_scene(tmp_path)
    (tmp_path / SCENE).write_text(json.dumps({"schema_version": 1, "seed": "x"}))
    with pytest.raises(UsageError, match=r"scene_id: Field required"):
        read_scene(tmp_path)
