"""Replayed pictures: the robot is drawn where the recording says, by its own kinematics and by Pinocchio's."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from boxy_robot import boxy_robot, moving
from manitwin.episodes.cameras import named_cameras
from manitwin.episodes.recording import Recording
from manitwin.episodes.replay_pictures import (
    FINE_PX,
    MOST_OF_FINGERS_M,
    EpisodeReplay,
    link_poses,
    link_tolerance_m,
    object_tolerance_m,
)
from manitwin.episodes.robot_appearance import link_drawables, link_visuals
from manitwin.errors import UsageError
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import project
from manitwin.render.raycast import cast_camera
from manitwin.render.surfaces import plain_part
from manitwin.robots.load import load_robot
from manitwin.robots.robot import Robot

SIZE, STEPS = 128, 8
OBJECTS = np.array([[0.5, 0.25, 0.03], [0.45, -0.25, 0.03]])


def cubes() -> list[list[trimesh.Trimesh]]:
    return [[plain_part(trimesh.creation.box([0.06] * 3), color)] for color in ((220, 40, 40), (40, 200, 40))]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return boxy_robot(tmp_path_factory.mktemp("boxy"))


@pytest.fixture(scope="module")
def recording(robot: Robot) -> Recording:
    return moving(robot, STEPS, OBJECTS)


@pytest.fixture(scope="module")
def replay(robot: Robot) -> Iterator[EpisodeReplay]:
    with EpisodeReplay(robot, cubes()) as made:
        yield made


def world(robot: Robot, recording: Recording, state: int, ids: dict[str, int]) -> tuple[trimesh.Trimesh, np.ndarray]:
    """Everything but the furniture at a state as one mesh, and the id of each face's thing."""
    poses = link_poses(robot, recording.joint_positions_rad[state], recording.hand[state])
    things = [
        (ids[f"boxy/{link}"], part, poses[link]) for link, parts in link_visuals(robot.urdf).items() for part in parts
    ]
    for index, parts in enumerate(cubes()):
        things.append((ids[f"object_{index:02d}"], parts[0], transform(translation=OBJECTS[index])))
    table = trimesh.creation.box([1.3, 1.4, 0.04]).apply_translation([0.4, 0.0, -0.02])
    things.append((ids["table"], table, np.eye(4)))
    meshes = [trimesh.Trimesh(transform_points(pose, m.vertices), m.faces, process=False) for _, m, pose in things]
    owner = np.concatenate([np.full(len(mesh.faces), thing[0]) for mesh, thing in zip(meshes, things, strict=True)])
    return trimesh.util.concatenate(meshes), owner


@pytest.mark.parametrize("camera", ["front", "side", "top", "wrist"])
def test_ids_and_depth_are_those_of_rays_at_the_recorded_states(
    robot: Robot, recording: Recording, replay: EpisodeReplay, camera: str
) -> None:
    named = named_cameras([camera], robot)
    frames = replay.frames(recording, named, width_px=SIZE, height_px=SIZE, every=4, geometry=True)
    for state, (frame,) in zip((0, 4, 8), frames, strict=True):
        tip = transform(
            rotation_from_quaternion_wxyz(recording.tip_quaternion_wxyz[state]), recording.tip_position_m[state]
        )
        view = named[0].placed(tip, SIZE, SIZE)
        mesh, owner = world(robot, recording, state, replay.ids)
        depth, _, face = cast_camera(RayCaster(mesh), view)
        expected = np.where(face >= 0, owner[face], 0)
        assert frame.ids is not None and frame.depth_m is not None
        above = expected > 0
        leg = (frame.ids == replay.ids["table"]) & (expected == 0)  # a table has legs in pictures only
        assert (frame.ids == expected)[~leg].mean() > 0.998
        same = above & (frame.ids == expected)
        assert np.quantile(np.abs(frame.depth_m - depth)[same], 0.999) < 1e-4


def test_fingertips_are_drawn_at_the_recorded_tip(robot: Robot, recording: Recording, replay: EpisodeReplay) -> None:
    """The pads' middle, half an opening to either side of the recorded tip, is seen as a finger from the front."""
    front = named_cameras(["front"], robot)
    fingers = {replay.ids[f"boxy/{link}"] for link in robot.finger_links}
    frames = list(replay.frames(recording, front, width_px=512, height_px=512, every=4, geometry=True))
    for state, (frame,) in zip((0, 4, 8), frames, strict=True):
        pose = transform(
            rotation_from_quaternion_wxyz(recording.tip_quaternion_wxyz[state]), recording.tip_position_m[state]
        )
        half = recording.gripper_opening_m[state] / 2 + 0.004
        pads = np.array([[side * half, 0.0, robot.gripper.tip_depth_m] for side in (-1, 1)])
        pixels, _ = project(transform_points(pose, pads), front[0].placed(pose, 512, 512))
        assert frame.ids is not None
        assert {int(frame.ids[int(y), int(x)]) for x, y in pixels} <= fingers


@pytest.mark.parametrize("name", ["panda", "ur5_robotiq"])
def test_link_poses_are_pinocchios(name: str) -> None:
    robot = load_robot(name)
    model = pin.buildModelFromXML(robot.urdf)
    data, rng = model.createData(), np.random.default_rng(3)
    for _ in range(3):
        joints = robot.home_rad + rng.uniform(-0.5, 0.5, len(robot.arm_joints))
        q = pin.neutral(model)
        for joint, value in (*zip(robot.arm_joints, joints, strict=True), *((f, 0.012) for f in robot.finger_joints)):
            q[model.joints[model.getJointId(joint)].idx_q] = value
        pin.framesForwardKinematics(model, data, q)
        for link, pose in link_poses(robot, joints, np.array([0.024])).items():
            expected = data.oMf[model.getFrameId(link, pin.FrameType.BODY)].homogeneous
            np.testing.assert_allclose(pose, expected, atol=1e-9)


def test_every_link_with_looks_has_its_own_colours() -> None:
    visuals = link_visuals(load_robot("panda").urdf)
    assert set(visuals) >= {"panda_link0", "panda_link7", "panda_hand", "panda_leftfinger"}
    colors = {tuple(part.visual.material.baseColorFactor[:3]) for parts in visuals.values() for part in parts}
    assert len(colors) > 3
    extents = np.concatenate([part.vertices for part in visuals["panda_link0"]])
    np.testing.assert_allclose(np.ptp(extents, axis=0), [0.21, 0.19, 0.14], atol=0.04)  # metres, Z up


def test_robot_of_boxes_is_blue_as_its_urdf_says(robot: Robot, recording: Recording, replay: EpisodeReplay) -> None:
    frame = next(
        replay.frames(recording, named_cameras(["side"], robot), width_px=SIZE, height_px=SIZE, geometry=True)
    )[0]
    seen = frame.rgb[frame.ids == replay.ids["boxy/base"]].mean(0)
    assert seen[2] > 2 * seen[0]


def test_objects_that_moved_are_drawn_elsewhere(robot: Robot, recording: Recording, replay: EpisodeReplay) -> None:
    positions = recording.object_positions_m.copy()
    positions[1:, 0] += [0.1, 0.0, 0.2]
    moved = replace(recording, object_positions_m=positions)
    top = named_cameras(["top"], robot)
    still, gone = (
        frame[0].ids for frame in replay.frames(moved, top, width_px=SIZE, height_px=SIZE, every=8, geometry=True)
    )
    assert still is not None and gone is not None
    first, second = (np.argwhere(ids == replay.ids["object_00"]).mean(0) for ids in (still, gone))
    assert np.linalg.norm(first - second) > 5
    other = [(ids == replay.ids["object_01"]).sum() for ids in (still, gone)]
    assert other[0] == other[1] > 20


def test_recording_of_other_objects_is_refused(robot: Robot, replay: EpisodeReplay) -> None:
    with pytest.raises(UsageError, match="has 1 objects, the replay 2"):
        next(replay.frames(moving(robot, 2, OBJECTS[:1]), named_cameras(["top"], robot), width_px=16, height_px=16))


def test_pictures_are_the_same_when_they_are_drawn_again(robot: Robot, recording: Recording, tmp_path: Path) -> None:
    runs = []
    for _ in range(2):
        with EpisodeReplay(robot, cubes()) as made:
            drawn = made.frames(recording, named_cameras(["front"], robot), width_px=64, height_px=64, every=4)
            runs.append(b"".join(frame[0].rgb.tobytes() for frame in drawn))
    assert runs[0] == runs[1]


def test_granules_are_drawn_where_they_were(robot: Robot, recording: Recording) -> None:
    middles = np.zeros((STEPS + 1, 2, 3), np.float32)
    middles[:, 0], middles[:, 1] = [0.55, 0.0, 0.03], [0.55, 0.1, 0.03]
    poured = replace(recording, granule_positions_m=middles)
    with EpisodeReplay(robot, cubes(), granules=(2, 0.03)) as made:
        (frame,) = next(
            made.frames(poured, named_cameras(["top"], robot), width_px=SIZE, height_px=SIZE, geometry=True)
        )
        ids = [made.ids[f"granule_{number:03d}"] for number in range(2)]
    places = [np.argwhere(frame.ids == each).mean(0) for each in ids]
    assert np.linalg.norm(places[1] - places[0]) > 5


@pytest.mark.slow
def test_links_for_small_pictures_have_fewer_triangles_and_look_alike() -> None:
    panda = load_robot("panda")
    joints, hand = np.array([0.0, -0.3, 0.0, -2.2, 0.0, 2.0, 0.785]), np.array([0.04])
    poses = [transform(translation=each) for each in OBJECTS]
    cameras = named_cameras(["front", "wrist"], panda)
    pictures = []
    for picture_px in (FINE_PX, SIZE):
        with EpisodeReplay(panda, cubes(), picture_px=picture_px) as made:
            pictures.append(np.stack(made.picture(poses, joints, hand, cameras, size_px=SIZE)).astype(int))
    fine, lean = pictures
    assert 0 < np.abs(fine - lean).mean() < 1.0
    assert (np.abs(fine - lean).max(-1) > 60).mean() < 0.002  # a pixel's width of an edge here and there
    faces = [
        sum(
            len(each.faces)
            for link in link_drawables(panda.urdf, link_tolerance_m(px), MOST_OF_FINGERS_M).values()
            for each in link.surfaces
        )
        for px in (FINE_PX, SIZE)
    ]
    assert faces[1] < 0.5 * faces[0]


def test_tolerance_grows_with_the_pixels_up_to_a_limit() -> None:
    assert [link_tolerance_m(px) for px in (2048, FINE_PX, 256)] == pytest.approx([0.0008, 0.0024, 0.006])
    assert link_tolerance_m(64) == link_tolerance_m(16) == 0.012
    assert [object_tolerance_m(px) for px in (1280, FINE_PX, 256)] == pytest.approx([0.0008, 0.0008, 0.002])
    assert object_tolerance_m(64) == object_tolerance_m(16) == 0.0024
    assert object_tolerance_m(64, MOST_OF_FINGERS_M) == MOST_OF_FINGERS_M
