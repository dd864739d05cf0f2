"""Numbers beside points."""

from __future__ import annotations

import numpy as np

from manitwin.render.markers import DOT, draw_markers, place_boxes

SHAPE = (512, 512)


def overlaps(centers: np.ndarray, sizes: np.ndarray) -> int:
    apart = np.abs(centers[:, None] - centers[None]) - (sizes[:, None] + sizes[None]) / 2
    return int(((apart < 0).all(2).sum() - len(centers)) / 2)


def test_crowded_numbers_do_not_cover_each_other() -> None:
    pixels = np.random.default_rng(0).normal([256, 256], 35, (24, 2))
    sizes = np.tile([22.0, 16.0], (24, 1))
    centers = place_boxes(pixels, sizes, SHAPE)
    assert overlaps(pixels, sizes) > 20  # were each put on its point
    assert overlaps(centers, sizes) <= 2


def test_numbers_stay_in_the_picture() -> None:
    pixels = np.array([[1.0, 1.0], [511.0, 1.0], [1.0, 511.0], [511.0, 511.0], [256.0, 2.0]])
    sizes = np.tile([30.0, 16.0], (5, 1))
    centers = place_boxes(pixels, sizes, SHAPE)
    assert (centers - sizes / 2 >= 0).all()
    assert (centers + sizes / 2 <= 512).all()


def test_numbers_leave_the_object_where_there_is_room() -> None:
    occupied = np.zeros(SHAPE, dtype=bool)
    occupied[:, 250:262] = True  # a stick
    pixels = np.array([[256.0, y] for y in range(60, 460, 40)])
    centers = place_boxes(pixels, np.tile([22.0, 16.0], (len(pixels), 1)), SHAPE, occupied)
    assert (np.abs(centers[:, 0] - 256) > 15).mean() > 0.8


def test_dot_is_drawn_on_its_point_and_nothing_far_away() -> None:
    picture = np.full((*SHAPE, 3), 128, dtype=np.uint8)
    marked = draw_markers(picture, np.array([[100.5, 200.5]]), ["17"])
    assert (marked[200, 100] == DOT).all()
    assert (marked[:, 200:] == 128).all()
    assert (picture == 128).all()


def test_no_points_leave_the_picture_as_it_is() -> None:
    picture = np.random.default_rng(0).integers(0, 255, (64, 64, 3)).astype(np.uint8)
    assert np.array_equal(draw_markers(picture, np.zeros((0, 2)), []), picture)


def test_equal_input_gives_equal_pixels() -> None:
    picture = np.full((*SHAPE, 3), 200, dtype=np.uint8)
    pixels = np.random.default_rng(1).uniform(0, 512, (30, 2))
    labels = [str(i) for i in range(30)]
    assert np.array_equal(draw_markers(picture, pixels, labels), draw_markers(picture, pixels, labels))


def test_no_line_runs_under_the_dot_of_another() -> None:
    for seed, spread in ((0, 40), (1, 60), (2, 90)):
        rng = np.random.default_rng(seed)
        pixels = rng.normal([256, 256], spread, (26, 2))
        apart = np.linalg.norm(pixels[:, None] - pixels[None], axis=2) + 1e9 * np.eye(len(pixels))
        pixels = pixels[apart.min(1) > 14]  # dots that touch each other cannot be told apart anyway
        centers = place_boxes(pixels, np.tile([22.0, 16.0], (len(pixels), 1)), SHAPE)
        for index, (start, end) in enumerate(zip(pixels, centers, strict=True)):
            share = np.clip((pixels - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
            away = np.linalg.norm(pixels - start - share[:, None] * (end - start), axis=1)
            assert np.delete(away, index).min() > 5.0, "the radius of a dot is 4 to 5 pixels at this size"
