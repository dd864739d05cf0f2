"""Cameras, pictures and clouds: what is read, and what is refused in one line."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manitwin.errors import UsageError
from manitwin.formats.label_picture import label_picture
from manitwin.scenes.locate.camera_file import read_camera
from manitwin.scenes.locate.input_files import read_cloud, read_view

CAMERA: dict[str, Any] = {
    "fx": 600.0, "fy": 610.0, "cx": 31.5, "cy": 23.5, "width": 64, "height": 48, "depth_unit_m": 0.001
}  # fmt: skip


def written(folder: Path, **changed: Any) -> Path:
    told = {name: value for name, value in {**CAMERA, **changed}.items() if value is not None}
    path = folder / "camera.json"
    path.write_text(json.dumps(told))
    return path


@pytest.mark.parametrize(
    ("changed", "unit_m", "middle"),
    [
        ({}, 0.001, 32.0),
        ({"pixel_centers_at": 0.5}, 0.001, 31.5),
        ({"depth_unit_m": None, "depth_scale": 0.1}, 0.0001, 32.0),
        ({"cx": None, "cy": None, "ppx": 31.5, "ppy": 23.5}, 0.001, 32.0),
        ({"fx": None, "K": [600, 0, 31.5, 0, 610, 23.5, 0, 0, 1]}, 0.001, 32.0),
    ],
)
def test_cameras_of_others_are_read(tmp_path: Path, changed: dict[str, Any], unit_m: float, middle: float) -> None:
    camera = read_camera(written(tmp_path, **changed))
    assert camera.depth_unit_m == pytest.approx(unit_m)
    assert camera.intrinsics[0, 2] == middle and camera.intrinsics[1, 1] == 610


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"depth_unit_m": None}, "does not give the unit"),
        ({"depth_unit_m": None, "depth_scale": 0.001}, "librealsense"),
        ({"depth_unit_m": 1000}, "metres per unit"),
        ({"fx": -1}, "fx is -1"),
        ({"width": None}, "width is missing"),
        ({"K": [1, 2, 3]}, "3 x 3"),
        ({"K": [10**400, *range(8)]}, "3 x 3"),
        ({"K": np.eye(3).tolist()[::-1]}, "pinhole"),
        ({"pixel_centers_at": 1}, "0 (OpenCV"),
    ],
)
def test_a_camera_that_does_not_say_all_is_refused(tmp_path: Path, changed: dict[str, Any], said: str) -> None:
    with pytest.raises(UsageError) as refused:
        read_camera(written(tmp_path, **changed))
    assert said in str(refused.value) and "camera.json" in str(refused.value) and "\n" not in str(refused.value)


def test_depths_are_metres_and_pictures_must_be_of_one_size(tmp_path: Path) -> None:
    depth, mask = tmp_path / "d.png", tmp_path / "m.png"
    depth.write_bytes(label_picture(np.full((48, 64), 1234)))
    mask.write_bytes(label_picture(np.eye(48, 64) * 255))
    view, shown = read_view(depth, written(tmp_path), None, mask)
    assert view.depth_m[5, 5] == pytest.approx(1.234) and shown is not None and shown.sum() == 48
    with pytest.raises(UsageError, match=r"64 x 48 pixels, .* says 32 x 48"):
        read_view(depth, written(tmp_path, width=32), None, mask)


def test_clouds_are_read_from_ply_and_npz(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    points = np.c_[rng.uniform(-0.05, 0.05, (400, 2)), np.full(400, 0.8)].astype(np.float32)
    npz, ply = tmp_path / "c.npz", tmp_path / "c.ply"
    np.savez(npz, points=points)
    header = (
        "ply\nformat ascii 1.0\nelement vertex 400\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    )
    ply.write_text(header + "\n".join(" ".join(map(str, row)) for row in points.tolist()))
    for path in (npz, ply):
        view, mask = read_cloud(path)
        seen = view.points(np.flatnonzero(mask))
        assert 100 < mask.sum() <= 400 and np.allclose(seen[:, 2], 0.8, atol=1e-6)
        assert np.abs(np.abs(seen[:, :2]).max(0) - 0.05).max() < 0.003


def zipped(array: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("points.npy", array)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("c.npz", {"other": np.zeros((100, 3))}, "no array points"),
        ("c.npz", {"points": np.zeros((100, 3))}, "behind the camera"),
        ("c.npz", {"points": np.tile((1.0, 1.0, 1e-300), (100, 1))}, "more than 89 degrees off the camera axis"),
        ("c.npz", zipped(b"\x93NUMPY\x01\x00\x04\x00((  "), "no .npz that can be read"),
        ("c.npz", {"points": np.ones((100, 2))}, r"\(N, 3\)"),
        ("c.npz", {"points": np.ones((9, 3))}, "9 points"),
        ("c.npz", {"points": np.array([{}] * 100)}, "no plain numbers"),
        ("c.npz", b"PK\x03\x04 broken", "no .npz"),
        ("c.ply", b"ply\nformat ascii 1.0\nelement vertex 9000\nproperty float x\nend_header\n", "truncated"),
        ("c.xyz", b"1 2 3", "is not a point cloud"),
    ],
)
def test_what_is_no_cloud_is_refused(tmp_path: Path, name: str, content: Any, said: str) -> None:
    path = tmp_path / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        np.savez(path, **content)
    with pytest.raises(UsageError, match=said):
        read_cloud(path)
