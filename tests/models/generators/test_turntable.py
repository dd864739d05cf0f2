"""Things that are turned before a camera that stays, at any height: the camera is told by the outlines."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.errors import Rejected
from manitwin.models.generators.lift.carved_part import MOST_COLOUR_PHOTOS, carved_part, select_colour_photos
from manitwin.models.generators.lift.carving import carve
from manitwin.models.generators.lift.multi_view_generation import generate_from_views
from manitwin.models.generators.lift.multi_view_result import MultiViewResult
from manitwin.models.generators.lift.pinhole import mean_ray_miss_px
from manitwin.models.generators.lift.surface import to_manifold
from manitwin.models.generators.lift.turntable import (
    TurntableCamera,
    calibrate_turntable,
    pinhole_silhouettes,
    scaled_masks,
)
from manitwin.models.generators.protocol import PhotoView
from turned_things import FOV_DEG, SIDES, turned_photo, turned_thing


def _turned(count: int, elevation_deg: float) -> tuple[list[tuple[str, np.ndarray]], list[float]]:
    turns = [360.0 * k / count for k in range(count)]
    return [(f"{turn:.0f}.png", turned_photo(turn, elevation_deg)) for turn in turns], turns


@pytest.mark.parametrize("elevation_deg", [pytest.param(0.0, marks=pytest.mark.slow), 30.0])
def test_a_camera_that_stays_is_told_by_the_outlines(elevation_deg: float) -> None:
    turns = [60.0 * k for k in range(6)]
    camera = calibrate_turntable([turned_photo(turn, elevation_deg, aside_m=0.02) for turn in turns], turns)
    focal = 0.75 * 0.5 / np.tan(np.deg2rad(FOV_DEG / 2))
    assert camera.elevation_deg == pytest.approx(elevation_deg, abs=3)
    assert camera.focal == pytest.approx(focal, rel=0.2)
    assert camera.axis_share == pytest.approx(0.5 - focal * 0.02 / 0.25, abs=0.01)


def test_an_outline_that_another_camera_saw_is_the_same_as_one_that_is_made_for_it() -> None:
    turns = [0.0, 70.0, 140.0]
    masks = scaled_masks([turned_photo(turn, 20.0) for turn in turns], 160)
    first, second = (
        pinhole_silhouettes(masks, TurntableCamera(elevation, 1.0, 0.5, 0.0), turns) for elevation in (10.0, 20.0)
    )
    mean_ray_miss_px(first)  # finds what is kept of the outlines
    moved = [sight.with_camera(other.matrix, other.focal_px) for sight, other in zip(first, second, strict=True)]
    assert mean_ray_miss_px(moved) == mean_ray_miss_px(second) != mean_ray_miss_px(first)
    assert all(one.rim_rays is other.rim_rays for one, other in zip(first, moved, strict=True))


@pytest.mark.slow
def test_eight_photos_from_above_make_the_thing_and_not_what_lies_below_it() -> None:
    carved = carve(*_turned(8, 30.0))
    true = turned_thing()
    size = np.ptp(true.vertices, axis=0)
    height = float(np.ptp(carved.surface.vertices[:, 1]))
    assert np.ptp(carved.surface.vertices, axis=0) * size[2] / height == pytest.approx(size[[0, 2, 1]], abs=0.004)
    assert to_manifold(carved.surface).volume() * (size[2] / height) ** 3 == pytest.approx(true.volume, rel=0.2)
    assert min(carved.covered_shares) > 0.97 and carved.camera is not None


@pytest.mark.slow
def test_more_photos_do_not_make_it_worse() -> None:
    true = turned_thing().volume / np.ptp(turned_thing().vertices[:, 2]) ** 3
    excess = []
    for count in (3, 5, 8):
        surface = carve(*_turned(count, 20.0)).surface
        excess.append(to_manifold(surface).volume() / np.ptp(surface.vertices[:, 1]) ** 3 / true - 1)
    assert excess[0] > excess[1] > excess[2] > 0


def test_three_level_photos_by_hand_are_taken_as_such() -> None:
    """Three outlines leave a camera's height and lens open: what level ones explain is not given an invented camera."""
    turns = [0.0, 120.0, 240.0]
    photos = [(f"{turn:.0f}.png", turned_photo(turn, 0.0)) for turn in turns]
    photos[1] = (photos[1][0], np.roll(photos[1][1], 9, axis=1))  # aimed a little beside it
    assert carve(photos, turns).camera is None


@pytest.mark.slow
def test_turns_that_run_the_other_way_round_are_told() -> None:
    photos, turns = _turned(5, 25.0)
    with pytest.raises(Rejected, match="where the turns are counted the other way round"):
        carve(photos, [-turn for turn in turns])


def test_a_photo_at_a_wrong_turn_is_named() -> None:
    photos, turns = _turned(5, 25.0)
    photos[3] = ("wrong.png", turned_photo(turns[3] + 70, 25.0))
    with pytest.raises(Rejected, match=r"wrong\.png: its outline does not match those of the other photos"):
        carve(photos, turns)


@pytest.mark.slow
def test_of_many_the_one_that_does_not_go_with_the_others_is_left_out_and_told() -> None:
    photos, turns = _turned(6, 25.0)
    photos[3] = ("wrong.png", turned_photo(turns[3] + 70, 25.0))
    made = generate_from_views(
        [PhotoView(name, rgba, turn) for (name, rgba), turn in zip(photos, turns, strict=True)], None
    )
    assert made.notes["left_out"] == ["wrong.png"]
    assert [view["turn_deg"] for view in made.notes["views"]] == [*turns[:3], *turns[4:]]
    assert made.notes["camera"]["elevation_deg"] == pytest.approx(25, abs=3)


@pytest.mark.slow
def test_of_many_that_do_not_go_together_one_is_named() -> None:
    photos, turns = _turned(5, 25.0)
    with pytest.raises(Rejected, match="these 5 outlines are not of one object at these turns") as refused:
        carve(photos, [turn / 2 for turn in turns])
    assert str(refused.value).count(".png") == 1


@pytest.mark.slow
def test_a_photo_that_was_scaled_is_used_and_one_that_was_cropped_is_named() -> None:
    photos, turns = _turned(5, 25.0)
    half = [*photos[:2], ("half.png", photos[2][1][::2, ::2]), *photos[3:]]
    carved = carve(half, turns)
    assert carved.camera is not None and carved.camera["elevation_deg"] == pytest.approx(25, abs=3)
    cropped = [*photos[:2], ("cropped.png", photos[2][1][30:, 30:290]), *photos[3:]]
    with pytest.raises(Rejected, match=r"cropped\.png: not of the shape of the other photos, 320 x 240 pixels"):
        carve(cropped, turns)


@pytest.fixture(scope="module")
def made() -> MultiViewResult:
    """What six photos from above, at stated turns, make."""
    photos, turns = _turned(6, 25.0)
    return generate_from_views(
        [PhotoView(name, rgba, turn) for (name, rgba), turn in zip(photos, turns, strict=True)], None
    )


def test_each_side_has_its_colour_from_above(made: MultiViewResult) -> None:
    part = made.part
    texture = np.asarray(part.visual.material.baseColorTexture.convert("RGB"))
    for normal, colour in (((1, 0, 0), SIDES[0]), ((0, -1, 0), SIDES[4]), ((0, 1, 0), SIDES[1]), ((0, 0, 1), SIDES[2])):
        faces = part.face_normals @ np.array(normal) > 0.95
        uv = np.asarray(part.visual.uv)[part.faces[faces]].mean(axis=1)
        at = np.clip(uv * texture.shape[1::-1], 0, np.array(texture.shape[1::-1]) - 1)
        seen = texture[(texture.shape[0] - 1 - at[:, 1]).astype(int), at[:, 0].astype(int)]
        assert faces.sum() > 10 and np.abs(np.median(seen, axis=0) - colour).max() < 12


@pytest.mark.slow
def test_the_texture_of_many_photos_is_about_square_and_of_some_that_are_spread() -> None:
    carved = carve(*_turned(13, 25.0))
    chosen = select_colour_photos(carved)
    assert len(chosen) == MOST_COLOUR_PHOTOS and {photo.name for photo in chosen} > {"0.png"}
    width, height = carved_part(carved).visual.material.baseColorTexture.size
    assert max(width, height) < 1.6 * min(width, height)


def test_what_the_camera_was_told_to_be_is_kept_in_the_notes(made: MultiViewResult) -> None:
    assert made.notes["camera"]["elevation_deg"] == pytest.approx(25, abs=3)
    assert [view["colours"] for view in made.notes["views"]] == [True] * 6
