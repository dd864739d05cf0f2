from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manitwin.apps.layouts.pool import read_pool
from manitwin.errors import UsageError
from scene_twins import BOWL_HEIGHT_M, THINGS, bowl, pool_of_things, slab, write_things
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


def test_place_without_twins_says_so(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no accepted twin"):
        read_pool(tmp_path)
