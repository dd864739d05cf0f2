"""What a depth camera saw, as a folder: of a drawn layout, and of a RealSense that a stand-in takes the place of."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from drawn_scenes import write_drawn_scenes
from fake_realsense import FRAMES_OF_A_FILE, FakeRealSense
from manitwin.cli.main import app
from manitwin.errors import Unavailable, UsageError
from manitwin.geometry.poses import inverse, transform_points
from manitwin.scenes.loaded_scene import object_pose
from manitwin.scenes.locate.capture_folder import capture_files, write_capture
from manitwin.scenes.locate.hand_eye_file import read_camera_to_base
from manitwin.scenes.locate.input_files import read_view
from manitwin.scenes.locate.realsense import WARM_UP, capture_view, sdk
from manitwin.scenes.locate.simulated_capture import capture_of_scene
from manitwin.scenes.perception.scene_truth import read_scene_truth
from manitwin.scenes.scene_files import scene_files


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return scene_files(write_drawn_scenes(tmp_path_factory.mktemp("drawn")))[0].parent


def test_a_layout_is_seen_as_it_stands_in_the_robots_frame(scene: Path, tmp_path: Path) -> None:
    truth = read_scene_truth(scene / "scene.json")
    name = truth.pictures[0].name
    capture = capture_of_scene(scene, name, 3)
    write_capture(tmp_path / "view", capture)
    files = capture_files(tmp_path / "view")
    view, _ = read_view(files["depth"], files["camera"], files["rgb"], None)
    true_m = truth.pictures[0].depth_m
    known = (view.depth_m > 0) & (true_m > 0)
    off = np.abs(view.depth_m - true_m)[known]
    assert known.mean() > 0.6 * (true_m > 0).mean() and 0.0005 < np.median(off) < 0.004, "noise, and no shift"
    base_to_camera = inverse(read_camera_to_base(files["base"]))
    for thing in truth.record.objects:
        mask = capture.masks.get(thing.name)
        if mask is not None and mask.sum() > 300:
            center = transform_points(base_to_camera @ object_pose(thing), np.zeros((1, 3)))
            rows, columns = np.nonzero(mask)
            at = view.project(center)[0]
            assert columns.min() - 40 < at[0] < columns.max() + 40 and rows.min() - 40 < at[1] < rows.max() + 40
    assert (view.rgb == truth.pictures[0].rgb).all()
    again = capture_of_scene(scene, name, 3)
    assert (again.depth_m == capture.depth_m).all() and (
        capture_of_scene(scene, name, 4).depth_m != again.depth_m
    ).any()


def test_a_scene_without_that_camera_and_a_folder_of_several_are_refused(scene: Path) -> None:
    with pytest.raises(UsageError, match="unknown camera 'behind'"):
        capture_of_scene(scene, "behind", 0)
    with pytest.raises(UsageError, match="contains 2 scenes; give the folder of one"):
        capture_of_scene(scene.parents[2], "front", 0)


def test_a_camera_is_warmed_up_and_its_depths_are_medians_of_known_ones(tmp_path: Path) -> None:
    rs = FakeRealSense()
    seen = capture_view(rs, serial="0123")
    assert rs.calls == ["serial 0123", "depth z16", "color rgb8", "stop"]
    assert seen.depth_m[10, 10] == pytest.approx(0.7) and seen.depth_m[10, 3] in (0.0, pytest.approx(0.7))
    assert seen.depth_m[0, 0] == 0 and seen.rgb[0, 0, 0] > WARM_UP
    assert seen.intrinsics[0].tolist() == [60.0, 0, 31.5] and "D435" in seen.device
    write_capture(tmp_path / "view", seen)
    files = capture_files(tmp_path / "view")
    assert set(files) == {"depth", "camera", "rgb"}, "where the camera is nobody has said"
    view, _ = read_view(files["depth"], files["camera"], files["rgb"], None)
    assert view.intrinsics[0, 2] == 32.0 and view.depth_m[10, 10] == pytest.approx(0.7)


def test_a_recorded_file_is_played_to_its_end(tmp_path: Path) -> None:
    bag = tmp_path / "recorded.bag"
    bag.write_bytes(b"#ROSBAG V2.0")
    rs = FakeRealSense()
    seen = capture_view(rs, bag=bag)
    assert seen.rgb[0, 0, 0] == FRAMES_OF_A_FILE and rs.calls == ["stop"]
    bag.write_bytes(b"anything")
    with pytest.raises(Unavailable, match="cannot start"):
        capture_view(rs, bag=bag)


def test_no_camera_and_a_bent_picture_are_refused_in_one_line() -> None:
    with pytest.raises(Unavailable, match="No device connected"):
        capture_view(FakeRealSense(plugged_in=False))
    bent = FakeRealSense(coeffs=(0.25, -0.2, 0.0, 0.0, 0.0))
    with pytest.raises(UsageError, match="its lens distorts the picture by up to"):
        capture_view(bent)
    assert bent.calls[-1] == "stop", "the camera is let go"


def test_without_the_sdk_the_remedy_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    with pytest.raises(UsageError, match="pip install pyrealsense2"):
        sdk()


def test_the_command_line_saves_a_view_and_reads_it_again(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "view"
    done = CliRunner().invoke(app, ["capture", "--scene", str(scene), "--camera", "front", "-o", str(out)])
    assert done.exit_code == 0 and "masks of object_00" in done.stdout, done.output
    monkeypatch.setitem(sys.modules, "pyrealsense2", FakeRealSense())
    assert CliRunner().invoke(app, ["capture", "-o", str(tmp_path / "camera")]).exit_code == 0
    both = CliRunner().invoke(app, ["capture", "--scene", str(scene), "--serial", "1", "-o", str(tmp_path / "no")])
    assert "--scene and --serial name different sources" in str(both.exception)
    twin = next((scene.parents[3] / "set").glob("twins/*/*"))
    masked = next(out.glob("mask_*.png"))
    located = CliRunner().invoke(app, ["locate", str(twin), "--view", str(out), "--mask", str(masked)])
    assert located.exit_code in (0, 3), located.output
    empty = CliRunner().invoke(app, ["locate", str(twin), "--view", str(tmp_path)])
    assert "has no depth.png" in str(empty.exception)
