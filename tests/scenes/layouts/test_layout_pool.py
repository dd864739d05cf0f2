from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from articulated_twins import write_articulated
from manitwin.errors import TwinError, UsageError
from manitwin.scenes.layouts.layouts_run import twins_without_upright
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose, cached_pool, read_pool
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.store import RECORD, write_twin_record
from scene_twins import BOWL_HEIGHT_M, THINGS, bowl, pool_of_things, slab, write_thing, write_things
from twin_folders import write_rejected


def test_pool_has_the_accepted_twins_with_the_placements_that_stayed(tmp_path: Path) -> None:
    ids = write_things(tmp_path, THINGS[:3])
    write_rejected(tmp_path, 30)
    pool = read_pool(tmp_path)
    assert [twin.twin_id for twin in pool.twins] == sorted(ids)
    for twin in pool.twins:
        assert [pose.placement for pose in twin.poses] == [0]
        np.testing.assert_array_equal(twin.poses[0].object_to_plane, np.eye(4))
    knife = pool.of_category("knife")[0]
    assert pool.body(knife.twin_id).body.mass_kg == pytest.approx(0.08)


def test_category_is_found_with_words_before_it() -> None:
    pool = pool_of_things()
    assert {twin.category for twin in pool.of_category(" BOX ")} == {"box", "tea box"}
    assert [twin.category for twin in pool.of_category("tea box")] == ["tea box"]
    with pytest.raises(UsageError, match="no twin of category 'ox'"):
        pool.of_category("ox")


def test_opening_of_a_bowl_is_as_deep_as_its_walls_are_high() -> None:
    pool = pool_of_things((bowl(), slab("box", 0.1, 0.1, 0.1)))
    vessel, box = pool.of_category("bowl")[0], pool.of_category("box")[0]
    opening = pool.body(vessel.twin_id).opening
    assert opening is not None
    assert opening.depth_m == pytest.approx(BOWL_HEIGHT_M - 0.006, abs=1e-3)
    np.testing.assert_allclose(opening.center_m, [0, 0, BOWL_HEIGHT_M], atol=5e-3)
    assert pool.body(box.twin_id).opening is None


def test_upright_pool_keeps_other_placements_only_where_none_is_upright() -> None:
    standing = StandingPose(3, np.eye(4), 0.1, 0.1, upright=True)
    lying = StandingPose(0, np.eye(4), 0.9, 0.1)
    body = slab("box", 0.1, 0.1, 0.1).body()
    pool = Pool(
        [PoolTwin("aa", "r", "cup", (lying, standing), False), PoolTwin("bb", "r", "fork", (lying,), False)],
        lambda _: body,
    )
    assert [twin.has_upright_pose for twin in pool.twins] == [True, False]
    assert [twin.poses for twin in pool.upright.twins] == [(standing,), (lying,)]
    assert [twin.poses for twin in pool.twins] == [(lying, standing), (lying,)]
    assert pool.upright.body("aa") is pool.body("aa")


def test_twins_without_an_upright_placement_that_stayed_are_named(tmp_path: Path) -> None:
    ids = write_things(tmp_path, THINGS[:2])
    assert twins_without_upright(tmp_path) == ()
    folder = tmp_path / twin_name(ids[1])
    record = json.loads((folder / RECORD).read_bytes())
    for placement in record["placements"]:
        placement["upright"] = not placement["upright"]  # the one that is upright now did not stay
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    cached_pool.cache_clear()
    assert twins_without_upright(tmp_path) == (ids[1],)


def test_twins_with_joints_are_counted_as_the_rigid_bodies_that_they_are_here(tmp_path: Path) -> None:
    write_articulated(tmp_path / "one")
    assert read_pool(tmp_path).joints_remark == "twins with joints, each one rigid body here as it stands: 1"
    write_things(tmp_path / "rigid", THINGS[:2])
    assert read_pool(tmp_path / "rigid").joints_remark is None


def test_place_without_twins_says_so(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no accepted twin"):
        read_pool(tmp_path)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"placements": None}, "placements"),
        ({"placements": [{"settled": True}]}, "placements.0.position_m"),
        ({"status": "lost", "mesh": 3}, "mesh"),
        ({"language": {"category": ["mug"]}}, "language.category"),
    ],
)
def test_a_record_that_somebody_has_changed_is_one_line(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    identity = write_thing(tmp_path, 0, THINGS[1])
    path = tmp_path / "twins" / identity[:2] / identity / "twin.json"
    path.write_text(json.dumps(json.loads(path.read_bytes()) | change))
    with pytest.raises(TwinError, match=says):
        read_pool(tmp_path)
    path.write_text("[" * 100_000)
    with pytest.raises(TwinError, match="nested too deep"):
        read_pool(tmp_path)


@pytest.mark.parametrize("version", [-1, None, "4"])
def test_a_record_of_another_schema_version_is_refused(tmp_path: Path, version: Any) -> None:
    identity = write_thing(tmp_path, 0, THINGS[1])
    path = tmp_path / "twins" / identity[:2] / identity / "twin.json"
    path.write_text(json.dumps(json.loads(path.read_bytes()) | {"schema_version": version}))
    with pytest.raises(TwinError, match=f"{identity}/twin.json: schema version {version}.*build the twin again"):
        read_pool(tmp_path)


def test_a_twin_whose_record_was_altered_is_not_drawn(tmp_path: Path) -> None:
    identity = write_thing(tmp_path, 0, THINGS[1])
    assert read_pool(tmp_path).body(identity).body.mass_kg > 0
    path = tmp_path / "twins" / identity[:2] / identity / "twin.json"
    path.write_text(json.dumps(json.loads(path.read_bytes()) | {"revision": "0" * 64}))
    with pytest.raises(TwinError, match=r"altered since it was written .*build the twin again"):
        read_pool(tmp_path).body(identity)
