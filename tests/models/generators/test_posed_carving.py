"""Photos whose cameras are stated, from different distances and heights: the solid within their outlines, and its size."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import cv2
import numpy as np
import pytest
import trimesh

from manitwin.errors import Rejected
from manitwin.formats.camera_poses.posed_camera import Lens, PosedCamera
from manitwin.models.generators.lift import posed_carving, posed_views
from manitwin.models.generators.lift.carved_solid import CarvedSolid
from manitwin.models.generators.lift.multi_view_generation import generate_from_views
from manitwin.models.generators.lift.multi_view_result import MultiViewResult
from manitwin.models.generators.lift.posed_carving import carve_posed
from manitwin.models.generators.lift.posed_views import scale_to_poses
from manitwin.models.generators.lift.surface import to_manifold
from manitwin.models.generators.protocol import PhotoView
from posed_things import FOCAL_PX, HEIGHT, PLACES, TO_OPENCV, WIDTH, pose_at, posed_photo
from turned_things import turned_thing

POSES = [pose_at(*place, roll_deg=2.0 * (-1) ** k) for k, place in enumerate(PLACES)]
PHOTOS = [posed_photo(pose) for pose in POSES]
LENS = Lens((FOCAL_PX, FOCAL_PX), (WIDTH / 2, HEIGHT / 2), (WIDTH, HEIGHT))


@pytest.fixture(scope="module", autouse=True)
def the_same_photos_carved_once() -> Iterator[None]:
    """Keep what photos are carved to at their poses: what is made of it, in which unit, is looked at here."""
    kept: dict[tuple[Any, ...], Any] = {}

    def carved(photos: Any, cameras: Sequence[PosedCamera], turns_deg: Any) -> Any:
        pictures = tuple(rgba.tobytes() for _, rgba in photos)
        key = posed_carving.CELLS, pictures, tuple(each.world_to_camera.tobytes() for each in cameras), tuple(turns_deg)
        if key not in kept:
            kept[key] = carve_posed(photos, cameras, turns_deg)
        return kept[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(posed_views, "carve_posed", carved)
        yield


@pytest.fixture
def coarser(monkeypatch: pytest.MonkeyPatch) -> None:
    """Carve with a quarter of the cells: what is asked here shows with these too."""
    monkeypatch.setattr(posed_carving, "CELLS", 100)


def _cameras(poses: Sequence[np.ndarray]) -> list[PosedCamera]:
    turned = [TO_OPENCV @ pose[:3, :3].T for pose in poses]
    return [
        PosedCamera(f"{k}.png", np.column_stack([turn, -turn @ pose[:3, 3]]), LENS)
        for k, (turn, pose) in enumerate(zip(turned, poses, strict=True))
    ]


def _views(photos: Sequence[np.ndarray], cameras: Sequence[PosedCamera]) -> list[PhotoView]:
    return [
        PhotoView(camera.file, photo, float(place[0]), None, camera)
        for photo, camera, place in zip(photos, cameras, PLACES, strict=False)
    ]


@cache
def _made() -> MultiViewResult:
    """What is made of the seven photos at their poses, in metres."""
    return generate_from_views(_views(PHOTOS, _cameras(POSES)), None, 1.0)


@cache
def _carved_straight() -> CarvedSolid:
    """What the seven photos are carved to."""
    cameras = _cameras(POSES)
    carved, _ = carve_posed(
        [(each.file, photo) for each, photo in zip(cameras, PHOTOS, strict=True)], cameras, [0.0] * 7
    )
    return carved


def test_seven_photos_make_the_thing_in_metres() -> None:
    made = _made()
    true = turned_thing()
    # the hull of seven outlines, sampled by other means, is 4 to 5 mm wider than the thing, and a third larger
    assert made.metric and np.ptp(made.part.vertices, axis=0) == pytest.approx([0.084, 0.09, 0.1036], abs=0.002)
    assert 1.1 < made.part.volume / true.volume < 1.35
    assert made.notes["confidence"] > 0.97 and made.notes["left_out"] == []


@pytest.mark.usefixtures("coarser")
def test_the_unit_of_the_poses_is_that_of_the_size_and_without_one_there_is_none() -> None:
    scaled = [np.diag([1000, 1000, 1000, 1.0]) @ pose @ np.diag([0.001, 0.001, 0.001, 1]) for pose in POSES]
    in_millimetres = generate_from_views(_views(PHOTOS, _cameras(scaled)), None, 0.001)
    without = generate_from_views(_views(PHOTOS, _cameras(scaled)), None)
    assert np.ptp(in_millimetres.part.vertices, axis=0).max() == pytest.approx(0.1036, abs=0.002)
    assert not without.metric and np.ptp(without.part.vertices, axis=0).max() == pytest.approx(1.0)


@pytest.mark.slow
def test_a_world_far_from_its_origin_makes_the_same() -> None:
    moved = [np.array(pose) for pose in POSES]
    for pose in moved:
        pose[:3, 3] += [300.0, -20.0, 7.0]
    far = generate_from_views(_views(PHOTOS, _cameras(moved)), None, 1.0)
    sizes = [np.ptp(each.part.vertices, axis=0) for each in (_made(), far)]
    assert sizes[0] == pytest.approx(sizes[1], abs=1e-4)


def test_colours_are_those_of_the_photos() -> None:
    """The foot's sides along x and y and its top have their own colours on the texture."""
    part = _made().part
    texture = np.asarray(part.visual.material.baseColorTexture.convert("RGB"))
    centres, normals = part.triangles_center, part.face_normals
    uv = part.visual.uv[part.faces].mean(axis=1)
    pixels = texture[
        np.clip(((1 - uv[:, 1]) * texture.shape[0]).astype(int), 0, texture.shape[0] - 1),
        np.clip((uv[:, 0] * texture.shape[1]).astype(int), 0, texture.shape[1] - 1),
    ]
    top = (normals[:, 2] > 0.95) & (centres[:, 2] > 0.09)
    assert np.median(pixels[top], axis=0) == pytest.approx([50, 70, 200], abs=30)


@pytest.mark.usefixtures("coarser")
def test_cameras_from_below_see_the_underside_and_nothing_is_cut_off() -> None:
    places = [*PLACES[:5], (20, -40, 0.3), (200, -60, 0.3)]
    poses = [pose_at(*place) for place in places]
    made = generate_from_views(_views([posed_photo(pose) for pose in poses], _cameras(poses)), None, 1.0)
    assert np.ptp(made.part.vertices[:, 2]) > 0.113  # as high as the hull is, though the thing is not


@pytest.mark.usefixtures("coarser")
def test_a_photo_at_a_wrong_pose_is_left_out_of_many_and_named_of_few() -> None:
    cameras = _cameras([*POSES[:6], pose_at(20, 30, 0.25)])
    assert generate_from_views(_views(PHOTOS, cameras), None).notes["left_out"] == ["6.png"]
    with pytest.raises(Rejected, match=r"2\.png: its outline does not match its pose"):
        generate_from_views(_views(PHOTOS[:5], _cameras([*POSES[:2], pose_at(20, 30, 0.22), *POSES[3:5]])), None)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (lambda pose: pose @ np.diag([1.0, -1, -1, 1]), "y and z axes point the other way"),
        (np.linalg.inv, "from the world to an OpenGL camera"),
        (lambda pose: np.linalg.inv(pose @ np.diag([1.0, -1, -1, 1])), "from the world to an OpenCV camera"),
    ],
)
def test_another_convention_is_told(wrong: object, told: str) -> None:
    cameras = _cameras([wrong(pose) for pose in POSES])  # type: ignore[operator]
    with pytest.raises(Rejected, match=told):
        generate_from_views(_views(PHOTOS, cameras), None)


def test_poses_of_other_photos_are_told_with_what_to_check() -> None:
    mixed = [PHOTOS[k] for k in (3, 0, 5, 1, 6, 2, 4)]
    with pytest.raises(Rejected, match="focal lengths are in pixels"):
        generate_from_views(_views(mixed, _cameras(POSES)), None)


def test_photos_from_one_direction_and_its_opposite_are_refused() -> None:
    poses = [pose_at(0, 5, 0.25), pose_at(6, 5, 0.3), pose_at(183, -5, 0.25)]
    photos = [posed_photo(pose) for pose in poses]
    with pytest.raises(Rejected, match="add a photo from the side"):
        generate_from_views(_views(photos, _cameras(poses)), None)


@pytest.mark.usefixtures("coarser")
@pytest.mark.parametrize("fisheye", [pytest.param(False, marks=pytest.mark.slow), True])
def test_the_distortion_of_a_lens_is_undone(fisheye: bool) -> None:
    """The photos are bent as the lens does it; without its coefficients the outlines do not fill each other as far."""
    bent = (0.12, 0.05, 0.0, 0.0) if fisheye else (-0.35, 0.1, 0.002, -0.001, 0, 0, 0, 0)
    lens = replace(LENS, distortion=bent, fisheye=fisheye)
    matrix = np.array([[FOCAL_PX, 0, WIDTH / 2 - 0.5], [0, FOCAL_PX, HEIGHT / 2 - 0.5], [0, 0, 1]])
    pixels = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), axis=-1).reshape(-1, 1, 2).astype(float)
    if fisheye:
        straight = cv2.fisheye.undistortPoints(pixels, matrix, np.array(bent), None, matrix)
    else:
        straight = cv2.undistortPoints(pixels, matrix, np.array(bent), None, matrix)
    at = straight.reshape(HEIGHT, WIDTH, 2).astype(np.float32)
    photos = [cv2.remap(photo, at[..., 0], at[..., 1], cv2.INTER_NEAREST) for photo in PHOTOS]
    cameras = [replace(camera, lens=lens) for camera in _cameras(POSES)]
    photos_of = [(camera.file, photo) for camera, photo in zip(cameras, photos, strict=True)]
    carved, _ = carve_posed(photos_of, cameras, [0.0] * 7)
    straight = _carved_straight()
    assert min(carved.covered_shares) > 0.97
    assert to_manifold(carved.surface).volume() == pytest.approx(to_manifold(straight.surface).volume(), rel=0.05)


@pytest.mark.slow
@pytest.mark.usefixtures("coarser")
def test_a_photo_that_was_scaled_since_makes_the_same() -> None:
    half = [cv2.resize(photo, (WIDTH // 2, HEIGHT // 2), interpolation=cv2.INTER_AREA) for photo in PHOTOS]
    made = generate_from_views(_views(half, _cameras(POSES)), None, 1.0)
    assert np.ptp(made.part.vertices, axis=0) == pytest.approx([0.084, 0.09, 0.1036], abs=0.003)


def test_a_template_is_as_large_as_the_outlines_allow() -> None:
    views = _views(PHOTOS, _cameras(POSES))  # whose hull is 8.4 x 9 x 10.4
    for sides, height in (((0.4, 0.85, 1.0), 0.1036), ((0.8, 0.95, 1.0), 0.0948)):
        sized = scale_to_poses(MultiViewResult(trimesh.creation.box(sides), {}, 0.0), views, 1.0)
        assert sized.metric and sized.part.extents == pytest.approx(np.array(sides) * height, rel=0.03)
