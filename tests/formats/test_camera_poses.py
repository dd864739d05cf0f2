"""Files that state cameras: transforms.json, models of COLMAP as text and binary, and what is refused of them."""

from __future__ import annotations

import json
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manitwin.errors import InputError
from manitwin.formats.camera_poses.colmap_model import MODELS
from manitwin.formats.camera_poses.matching import cameras_of
from manitwin.formats.camera_poses.posed_camera import Lens, PosedCamera
from manitwin.formats.camera_poses.read import read_camera_poses
from posed_things import FOCAL_PX, HEIGHT, PLACES, TO_OPENCV, WIDTH, colmap_text, pose_at, transforms_document

POSES = [pose_at(*place) for place in PLACES[:3]]


def _written(folder: Path, document: Any) -> Path:
    path = folder / "transforms.json"
    path.write_text(json.dumps(document))
    return path


def test_transforms_json_is_read_as_opengl_poses_to_the_world(tmp_path: Path) -> None:
    found = read_camera_poses(_written(tmp_path, transforms_document(POSES, k1=0.1, p2=0.01, units="cm")))
    assert (found.format, found.unit_m, len(found.cameras)) == ("transforms.json", 0.01, 3)
    camera = found.cameras[1]
    point = np.array([0.01, -0.02, 0.03])
    seen = TO_OPENCV @ (np.linalg.inv(POSES[1]) @ [*point, 1])[:3]
    assert camera.world_to_camera @ [*point, 1] == pytest.approx(seen)
    assert camera.lens.focal == pytest.approx((FOCAL_PX, FOCAL_PX))
    assert camera.lens.distortion == (0.1, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.0) and not camera.lens.fisheye


def test_a_lens_may_be_an_angle_and_each_frame_may_have_its_own(tmp_path: Path) -> None:
    frames = [{"file_path": "./r_0", "transform_matrix": POSES[0].tolist()[:3]}]
    frames.append({"file_path": "r_1", "transform_matrix": POSES[1].tolist(), "fl_x": 50, "w": 60, "h": 40})
    found = read_camera_poses(_written(tmp_path, {"camera_angle_x": 0.8, "frames": frames})).cameras
    assert found[0].lens.with_picture_size(640, 480).focal == pytest.approx((320 / np.tan(0.4),) * 2)
    assert found[0].lens.with_picture_size(640, 480).centre_px == (320, 240)
    assert found[1].lens.with_picture_size(640, 480) == Lens((50, 50), (30, 20), (60, 40))
    fisheye = {"camera_model": "OPENCV_FISHEYE", "k1": 0.1, **transforms_document(POSES)}
    assert read_camera_poses(_written(tmp_path, fisheye)).cameras[0].lens.distortion == (0.1, 0, 0, 0)


def test_a_focal_length_of_a_frame_takes_the_place_of_all_that_the_file_says_of_one(tmp_path: Path) -> None:
    document = transforms_document(POSES, fl_x=300, fl_y=400)
    document["frames"][0] |= {"fl_x": 200}
    document["frames"][1] |= {"camera_angle_x": 0.8}
    lenses = [
        camera.lens.with_picture_size(WIDTH, HEIGHT)
        for camera in read_camera_poses(_written(tmp_path, document)).cameras
    ]
    assert [lens.focal for lens in lenses] == [
        (200, 200),
        pytest.approx((WIDTH / 2 / np.tan(0.4),) * 2),
        (300, 400),
    ]


def test_a_mask_is_one_below_the_folder_of_the_file(tmp_path: Path) -> None:
    document = transforms_document(POSES)
    document["frames"][1]["mask_path"] = "./masks\\1.png"
    cameras = read_camera_poses(_written(tmp_path, document)).cameras
    assert [camera.mask for camera in cameras] == [None, tmp_path / "masks" / "1.png", None]


def _with_matrix(matrix: np.ndarray) -> dict[str, Any]:
    return transforms_document([matrix])


_MIRROR = POSES[0] @ np.diag([-1.0, 1, 1, 1])
_SCALED = POSES[0] @ np.diag([1.3, 1.3, 1.3, 1])
_BROKEN: list[tuple[Any, str]] = [
    ({"frames": []}, "no list 'frames'"),
    ({"frames": [{"transform_matrix": 1}]}, "frame 0 has no file_path"),
    (_with_matrix(_MIRROR), "mirrors the world"),
    (_with_matrix(_SCALED), r"lengths 1.3, 1.3, 1.3"),
    (_with_matrix(POSES[0].T), "last row"),
    (transforms_document(POSES, frames=[{"file_path": "a", "transform_matrix": [[1, 2], [3]]}]), "4 rows of 4"),
    (transforms_document(POSES, fl_x=-5), "not above 0"),
    (transforms_document(POSES, fl_x="wide"), "'wide' is not a number"),
    (transforms_document(POSES, k1=1e9), "distortion coefficient"),
    (transforms_document(POSES, units="parsec"), "units is parsec"),
    (transforms_document(POSES, camera_model="EQUIRECTANGULAR"), "EQUIRECTANGULAR is not read"),
    ({"frames": transforms_document(POSES)["frames"]}, "the lens is not given"),
    *(
        (
            {
                **transforms_document(POSES[:1]),
                "frames": [{**transforms_document(POSES)["frames"][0], "mask_path": said}],
            },
            told,
        )
        for said, told in (
            ("../masks/0.png", "leads outside the folder"),
            ("/etc/0.png", "leads outside the folder"),
            ("C:\\masks\\0.png", "leads outside the folder"),
            (7, "names no file"),
            (" ", "names no file"),
            ("./", "names no file"),
        )
    ),
]


@pytest.mark.parametrize(("document", "told"), _BROKEN)
def test_what_states_no_camera_is_refused_in_one_line(tmp_path: Path, document: Any, told: str) -> None:
    with pytest.raises(InputError, match=told) as caught:
        read_camera_poses(_written(tmp_path, document))
    assert "transforms.json" in caught.value.detail and "\n" not in caught.value.detail


def test_numbers_that_are_none_are_refused(tmp_path: Path) -> None:
    document = transforms_document(POSES)
    document["frames"][0]["transform_matrix"][0][0] = float("nan")
    with pytest.raises(InputError, match="not a finite number"):
        read_camera_poses(_written(tmp_path, document))


def _model(folder: Path) -> tuple[Path, Path]:
    """One model as text and as binary, in a world of its own."""
    turn = np.array([[0, 0, 1.0], [1.0, 0, 0], [0, 1.0, 0]])
    text, binary = folder / "text", folder / "binary"
    text.mkdir()
    binary.mkdir()
    cameras, images = colmap_text(POSES, turn)
    (text / "cameras.txt").write_text(cameras)
    (text / "images.txt").write_text(images)
    content = struct.pack("<QIiQQ3d", 1, 7, 0, WIDTH, HEIGHT, FOCAL_PX, WIDTH / 2, HEIGHT / 2)
    (binary / "cameras.bin").write_bytes(content)
    rows = [line.split() for line in images.splitlines() if line.endswith(".png")]
    content = struct.pack("<Q", len(rows))
    for row in rows:
        content += struct.pack("<I7dI", int(row[0]), *map(float, row[1:8]), 7) + row[9].encode() + b"\0"
        content += struct.pack("<Q", 2) + bytes(48)
    (binary / "images.bin").write_bytes(content)
    return text, binary


def test_a_model_of_colmap_is_the_same_as_text_and_binary(tmp_path: Path) -> None:
    text, binary = _model(tmp_path)
    of_text, of_binary = read_camera_poses(text).cameras, read_camera_poses(binary).cameras
    assert [camera.file for camera in of_text] == ["0.png", "1.png", "2.png"]
    for one, other in zip(of_text, of_binary, strict=True):
        assert np.array_equal(one.world_to_camera, other.world_to_camera) and one.lens == other.lens
    assert read_camera_poses(text / "images.txt").cameras[0].lens == of_text[0].lens
    positions = [-c.world_to_camera[:, :3].T @ c.world_to_camera[:, 3] for c in of_text]
    assert np.linalg.norm(positions[0] - positions[1]) == pytest.approx(np.linalg.norm(POSES[0] - POSES[1], axis=0)[3])


def test_lines_of_points_may_be_missing(tmp_path: Path) -> None:
    text, _ = _model(tmp_path)
    lines = [line for line in (text / "images.txt").read_text().splitlines() if line.endswith("png")]
    (text / "images.txt").write_text("\n".join(lines))
    assert len(read_camera_poses(text).cameras) == 3


@pytest.mark.parametrize(
    ("file", "change", "told"),
    [
        ("text/images.txt", lambda text: text.replace(" 7 0.png", " 8 0.png"), "camera 8 is not in cameras.txt"),
        ("text/images.txt", lambda text: re.sub(r"\n1 \S+", "\n1 5.0", text), "quaternion has the length"),
        ("text/images.txt", lambda text: "", "has no images"),
        ("text/cameras.txt", lambda text: text.replace("SIMPLE_PINHOLE", "FOV"), "FOV is not read"),
        ("text/cameras.txt", lambda text: text.replace("SIMPLE_PINHOLE", "OPENCV"), "3 parameters, but needs 8"),
    ],
)
def test_a_broken_model_is_refused_in_one_line(tmp_path: Path, file: str, change: Any, told: str) -> None:
    _model(tmp_path)
    (tmp_path / file).write_text(change((tmp_path / file).read_text()))
    with pytest.raises(InputError, match=told):
        read_camera_poses(tmp_path / "text")


def test_a_binary_model_that_was_cut_or_counts_more_than_it_has_is_refused(tmp_path: Path) -> None:
    _, binary = _model(tmp_path)
    images = (binary / "images.bin").read_bytes()
    for content in (images[:-10], struct.pack("<Q", 1 << 60) + images[8:], images[:100]):
        (binary / "images.bin").write_bytes(content)
        with pytest.raises(InputError, match="not a COLMAP model, or truncated"):
            read_camera_poses(binary)


def test_every_model_of_colmap_is_read_or_told() -> None:
    assert len(MODELS) == 11 and dict(MODELS)["FULL_OPENCV"] == 12


def _camera(file: str) -> PosedCamera:
    return PosedCamera(file, np.eye(4)[:3], Lens((1, 1)))


def test_photos_are_matched_by_name_and_by_folders_where_names_are_the_same() -> None:
    cameras = [_camera(file) for file in ("./left/0.png", "./right/0.png", "../elsewhere/a.b", "C:\\shots\\x.jpg")]
    photos = [
        Path("/data/right/0.png"),
        Path("/data/left/0.png"),
        Path("/data/a.b.png"),
        Path("/y/x.png"),
        Path("/y/n.png"),
    ]
    found = cameras_of(photos, cameras, "transforms.json")
    assert [None if camera is None else cameras.index(camera) for camera in found] == [1, 0, 2, 3, None]
    with pytest.raises(InputError, match=r"matches several entries of .*: left/0\.png, right/0\.png"):
        cameras_of([Path("/other/0.png")], cameras, "transforms.json")
    with pytest.raises(InputError, match="both match the same pose"):
        cameras_of([Path("/one/x.png"), Path("/two/x.png")], cameras, "transforms.json")
