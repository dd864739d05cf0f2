from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from manitwin.scenes.layouts.surroundings import MATERIALS, make_cameras, make_furniture


@pytest.mark.parametrize(("kind", "height_m"), [("table", 0.0), ("shelf", 0.02), ("tray", 0.01)])
def test_supports_are_the_tops_of_their_boxes(kind: str, height_m: float) -> None:
    for seed in range(5):
        furniture = make_furniture(kind, np.random.default_rng(seed))
        boxes = {box.name: box for box in furniture.boxes}
        assert len(boxes) == len(furniture.boxes)
        assert furniture.support_height_m == height_m
        assert {box.material for box in furniture.boxes} <= set(MATERIALS)
        for support in furniture.supports:
            box = boxes[support.name]
            assert box.center_m[2] + box.half_extents_m[2] == pytest.approx(support.height_m)
            inside = np.abs(np.subtract(support.center_m, box.center_m[:2])) + support.half_extents_m
            assert (inside <= np.array(box.half_extents_m[:2]) + 1e-9).all()


def test_table_is_at_least_as_large_as_a_real_one_and_leaves_room_for_a_base() -> None:
    [table] = make_furniture("table", np.random.default_rng(0)).boxes
    assert 2 * table.half_extents_m[0] >= 0.8 and 2 * table.half_extents_m[1] >= 1.0
    [support] = make_furniture("table", np.random.default_rng(0)).supports
    assert support.center_m[0] - support.half_extents_m[0] >= 0.2


def test_rim_of_a_tray_is_3_cm_and_closed() -> None:
    furniture = make_furniture("tray", np.random.default_rng(1))
    rims = [box for box in furniture.boxes if "rim" in box.name]
    floor = next(box for box in furniture.boxes if box.name == "tray")
    assert len(rims) == 4
    for rim in rims:
        assert rim.center_m[2] + rim.half_extents_m[2] == pytest.approx(furniture.support_height_m + 0.03)
    corner = np.add(floor.center_m, floor.half_extents_m)[:2] + 0.005  # inside of the wall around the corner
    within = [(np.abs(corner - np.array(rim.center_m)[:2]) <= np.array(rim.half_extents_m)[:2]).all() for rim in rims]
    assert any(within)


def test_boards_of_a_shelf_are_apart_by_the_clearance() -> None:
    furniture = make_furniture("shelf", np.random.default_rng(2))
    low, high = furniture.supports
    upper = next(box for box in furniture.boxes if box.name == high.name)
    assert low.clearance_m == pytest.approx(upper.center_m[2] - upper.half_extents_m[2] - low.height_m)
    assert high.clearance_m is None


def test_same_seed_same_furniture() -> None:
    assert make_furniture("shelf", np.random.default_rng(3)) == make_furniture("shelf", np.random.default_rng(3))
    drawn = {make_furniture("table", np.random.default_rng(seed)).boxes[0].material for seed in range(40)}
    assert drawn == set(MATERIALS)


@pytest.mark.parametrize("seed", range(8))
def test_no_board_of_a_shelf_hides_what_stands_below_it_from_its_overview(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shelf = make_furniture("shelf", rng)
    lower, upper = shelf.supports
    half_m = np.array(lower.half_extents_m)
    corners = [np.array([*(lower.center_m + sign * half_m), at_m]) for sign, at_m in ((-1, 0.02), (1, upper.height_m))]
    cameras = {camera.name: camera for camera in make_cameras("shelf", corners[0], corners[1] + [0, 0, 0.2], rng)}
    eye = np.array(cameras["overview"].position_m)
    board = next(box for box in shelf.boxes if box.name == "shelf_1")
    for x, y in product(np.linspace(-0.9, 0.9, 7), np.linspace(-0.7, 0.7, 7)):
        place = np.array([*(lower.center_m + half_m * [x, y]), lower.height_m + 0.01])
        points = place + np.linspace(0, 1, 2000)[:, None] * (eye - place)
        inside = (np.abs(points - board.center_m) < board.half_extents_m).all(1)
        assert not inside.any(), (x, y)
