"""Depth and ids in colours: the colour says the number, and the scale beside it says which."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from manitwin.render.false_colors import (
    NOTHING_RGB,
    depth_in_colors,
    depth_picture,
    depth_range_m,
    id_color,
    ids_in_colors,
    ids_picture,
)


def test_colours_of_forty_ids_differ_so_that_one_sees_it() -> None:
    colors = np.array([id_color(number) for number in range(41)], float)
    assert tuple(colors[0]) == NOTHING_RGB
    assert min(np.linalg.norm(a - b) for a, b in combinations(colors, 2)) > 25
    neighbours = np.linalg.norm(np.diff(colors[1:], axis=0), axis=1)
    assert neighbours.min() > 120  # things of a scene have numbers that follow each other


def test_ids_have_their_colours() -> None:
    ids = np.array([[0, 1], [7, 300]], np.uint16)
    assert [tuple(rgb) for rgb in ids_in_colors(ids).reshape(-1, 3).tolist()] == [id_color(n) for n in (0, 1, 7, 300)]


def test_depth_goes_from_red_to_blue_and_stays_blue_beyond() -> None:
    depth = np.array([[0.5, 1.0, 1.5, 9.0, 0.0]])
    red, green, blue, beyond, nothing = depth_in_colors(depth, (0.5, 1.5))[0].astype(int)
    assert red[0] > 2 * max(red[1:]) and green[1] > 2 * green[2] and blue[2] > blue[1]
    assert (beyond == blue).all() and tuple(nothing) == NOTHING_RGB


def test_scale_has_the_colours_of_the_depths_along_it() -> None:
    height = 256
    ramp = np.repeat(np.linspace(0.4, 2.0, height)[:, None], 100, axis=1)
    page = np.asarray(depth_picture(ramp, np.ones_like(ramp, int))).astype(int)
    margin, bar = height // 32, height // 20
    scale = page[margin : height - margin, 100 + margin + bar // 2]
    depths = np.linspace(0.4, 2.0, len(scale))
    picture = page[np.searchsorted(ramp[:, 0], depths), 50]
    assert np.abs(scale - picture).max() < 12


def test_what_is_no_thing_does_not_stretch_the_scale() -> None:
    depth, ids = np.array([[0.5, 1.0, 12.0, 0.0]]), np.array([[1, 2, 0, 0]])
    assert depth_range_m(depth, ids) == (0.5, 1.0)
    assert depth_range_m(depth, np.zeros_like(ids)) is None


@pytest.mark.parametrize("height", [64, 512])
def test_names_are_there_of_what_is_seen_alone(height: int) -> None:
    ids = np.zeros((height, height), int)
    ids[: height // 2], ids[height // 2 :, : height // 2] = 1, 4
    names = {"object_00 mug": 1, "object_01 hidden": 2, "table": 4}
    page = np.asarray(ids_picture(ids, names))
    legend = page[:, height:].reshape(-1, 3)
    for number, seen in ((1, True), (2, False), (4, True)):
        assert (legend == id_color(number)).all(1).any() == seen
    assert (page[:, :height] == ids_in_colors(ids)).all()


def test_many_names_go_into_several_columns() -> None:
    ids = np.arange(64 * 64).reshape(64, 64) % 61
    page = np.asarray(ids_picture(ids, {f"thing {n}": n for n in range(1, 61)}))
    legend = page[:, 64:].reshape(-1, 3)
    assert all((legend == id_color(number)).all(1).any() for number in range(1, 61))


def test_nothing_to_see_has_no_scale_and_no_names() -> None:
    empty = np.zeros((32, 48))
    assert depth_picture(empty, empty.astype(int)).size == (48, 32)
    assert ids_picture(empty.astype(int), {"mug": 1}).size == (48, 32)
