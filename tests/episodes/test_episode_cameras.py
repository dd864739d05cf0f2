"""Named cameras: what they must see, for every robot that comes with the package."""

from __future__ import annotations

import numpy as np
import pytest

from boxy_robot import tip_pose
from manitwin.episodes.cameras import NamedCamera, named_cameras
from manitwin.errors import UsageError
from manitwin.geometry.poses import transform, transform_points
from manitwin.render.cameras import project
from manitwin.robots.grippers.suction import SuctionGripper
from manitwin.robots.load import load_robot, shipped_robots
from manitwin.robots.two_arms import base_to_world

SIZE = 256


def inside(pixels: np.ndarray, depth: np.ndarray) -> np.ndarray:
    return (depth > 0) & (pixels > 0).all(1) & (pixels < SIZE).all(1)


@pytest.mark.parametrize("name", shipped_robots())
def test_standing_cameras_see_the_whole_workspace(name: str) -> None:
    robot = load_robot(name)
    space = robot.workspace
    angles = np.linspace(-space.half_angle_rad, space.half_angle_rad, 9)
    radii = np.array([space.min_radius_m, space.max_radius_m])[:, None]
    sector = np.stack([radii * np.cos(angles), radii * np.sin(angles), 0 * radii * angles], -1).reshape(-1, 3)
    for camera in named_cameras(["front", "side", "top"], robot):
        assert inside(*project(sector, camera.placed(np.eye(4), SIZE, SIZE))).all(), camera.name


@pytest.mark.parametrize("name", shipped_robots())
def test_front_camera_sees_the_hand_at_home(name: str) -> None:
    robot = load_robot(name)
    tip = tip_pose(robot, robot.home_rad)
    point = transform_points(tip, np.array([[0, 0, robot.gripper.tip_depth_m]]))
    assert inside(*project(point, named_cameras(["front"], robot)[0].placed(tip, SIZE, SIZE))).all()


def test_front_camera_of_two_arms_sees_the_table_between_them_past_both() -> None:
    robot = load_robot("two_pandas")
    camera = named_cameras(["front"], robot)[0]
    front = camera.placed(np.eye(4), SIZE, SIZE)
    bases = [base_to_world(arm) for arm in robot.arms]
    places = np.array([[x, y, z] for x in (0.3, 0.45, 0.6) for y in (-0.25, 0.0, 0.25) for z in (0.0, 0.45)])
    seen = np.vstack([transform_points(base, places) for base in bases])
    assert inside(*project(seen, front)).all()
    eye = camera.camera_to_mount[:2, 3]
    for base in bases:
        shares = np.linspace(0, 1, 101)[:, None, None]
        sights = eye + shares * (seen[:, :2] - eye)
        assert np.linalg.norm(sights - base[:2, 3], axis=2).min() > 0.25, "an arm stands before the table"


@pytest.mark.parametrize("name", shipped_robots())
def test_wrist_camera_sees_the_fingertips_and_what_lies_between_them(name: str) -> None:
    robot = load_robot(name)
    wrist = named_cameras(["wrist"], robot)[0]
    depth = robot.gripper.tip_depth_m
    gripper = robot.gripper
    half = gripper.lip_radius_m if isinstance(gripper, SuctionGripper) else gripper.opening_m / 2
    points = np.array([[half, 0, depth], [-half, 0, depth], [0, 0, depth], [0, 0, depth + 0.05]])
    pixels, distance = project(points, wrist.placed(np.eye(4), SIZE, SIZE))
    assert inside(pixels, distance).all()
    assert pixels[0, 0] > pixels[1, 0]  # the +X finger at the right
    eye = wrist.camera_to_mount[:3, 3]
    for box_to_gripper, half_extents in robot.gripper.boxes(robot.gripper.opening_m):
        outside = np.abs(transform_points(np.linalg.inv(box_to_gripper), eye[None])[0]) - half_extents
        assert outside.max() > 0.01  # it is not inside the hand


def test_wrist_camera_rides_on_the_hand_and_the_others_stand() -> None:
    robot = load_robot("panda")
    moved = transform(translation=np.array([0.3, 0.1, 0.2]))
    for camera in named_cameras(["front", "wrist"], robot):
        here, there = (camera.placed(pose, SIZE, SIZE).position for pose in (np.eye(4), moved))
        np.testing.assert_allclose(there - here, moved[:3, 3] if camera.on_hand else np.zeros(3), atol=1e-12)


@pytest.mark.parametrize("camera", named_cameras(["front", "side", "top", "wrist"], load_robot("panda")))
def test_what_is_told_of_a_camera_puts_points_where_its_pictures_show_them(camera: NamedCamera) -> None:
    robot = load_robot("panda")
    tip = tip_pose(robot, robot.home_rad)
    points = transform_points(tip, np.array([[0.02, -0.01, 0.11], [-0.04, 0.0, 0.1034], [0.0, 0.01, 0.2]]))
    told = camera.to_json(320, SIZE)
    frame = {"tip": tip, "world": np.eye(4)}[told["camera.frame"]]
    seen = transform_points(np.linalg.inv(frame @ np.array(told["camera.camera_to_frame"])), points)
    across = seen @ np.array(told["camera.intrinsics_px"]).T  # OpenCV's: x right, y down, z away
    pixels, depth = project(points, camera.placed(tip, 320, SIZE))
    np.testing.assert_allclose(across[:, :2] / across[:, 2:], pixels, atol=1e-9)
    np.testing.assert_allclose(seen[:, 2], depth, atol=1e-12)


def test_unknown_camera_names_those_there_are() -> None:
    with pytest.raises(UsageError, match=r"did you mean 'wrist'\? Valid: front, side, top, wrist"):
        named_cameras(["wirst"], load_robot("panda"))
