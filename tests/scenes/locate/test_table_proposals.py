"""What stands on a table, without masks."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.errors import UsageError
from manitwin.scenes.locate.depth_view import DepthView
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.proposals import proposals, table_plane
from manitwin.scenes.locate.recognition import find_twin_in_masks
from seen_solids import seen_from


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    return float((one & other).sum() / (one | other).sum())


def test_the_table_is_the_plane_that_the_thing_stands_on_and_the_thing_is_what_is_above(stool: PoseModel) -> None:
    seen = seen_from(stool, 0.6, table=True)
    plane = table_plane(seen.view, np.random.default_rng(0))
    up = seen.object_to_camera[:3, 2]
    assert plane.normal @ up > np.cos(np.deg2rad(1))
    assert abs(plane.height_m(seen.object_to_camera[:3, 3])) < 0.003, "its origin stands on the table"
    (mask,) = proposals(seen.view, plane)
    assert overlap(mask, seen.mask) > 0.8


def test_a_table_before_a_larger_floor_is_what_things_stand_on(stool: PoseModel) -> None:
    seen = seen_from(stool, 0.6, table=True)
    columns = np.indices(seen.mask.shape)[1]
    table = np.abs(columns - 120) < 55
    rays = seen.view.rays(np.arange(seen.mask.size))
    up, origin = seen.object_to_camera[:3, 2], seen.object_to_camera[:3, 3]
    floor = ((origin - 0.35 * up) @ up / (rays @ up)).reshape(seen.mask.shape)
    depth = np.where(table | seen.mask, seen.view.depth_m, floor)
    plane = table_plane(DepthView(depth, seen.view.intrinsics), np.random.default_rng(0))
    assert abs(plane.height_m(origin)) < 0.004


def test_without_a_plane_a_mask_is_asked_for() -> None:
    rng = np.random.default_rng(0)
    cloud = DepthView(rng.uniform(0.5, 3.0, (64, 64)), np.array([[60.0, 0, 32], [0, 60, 32], [0, 0, 1]]))
    with pytest.raises(UsageError, match="give --mask"):
        table_plane(cloud, rng)


def test_of_several_things_the_twin_is_the_one_that_it_explains(stool: PoseModel) -> None:
    seen = seen_from(stool, 0.6)
    other = np.zeros_like(seen.mask)
    other[5:40, 5:60] = True  # a piece of the wall
    found = find_twin_in_masks(seen.view, [other, seen.mask], stool)
    assert found.location.status == "found" and np.array_equal(found.mask, seen.mask)
    with pytest.raises(UsageError, match="no object stands above"):
        find_twin_in_masks(seen.view, [], stool)
