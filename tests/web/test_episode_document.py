"""The document that an episode's page draws: objects and robots where they were, at the times that are kept."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from asked_episodes import document, get, run_of

from boxy_robot import boxy_robot, moving
from drawn_episodes import GRASPED, STEPS, recording, stored, write_run
from drawn_scenes import write_scenes
from manitwin.episodes.recording import Recording
from manitwin.episodes.stored_episode import recorded_robot
from manitwin.formats.glb import unpack_glb
from manitwin.robots.load import load_robot


def test_the_document_has_objects_and_links_where_they_were(run: Path) -> None:
    told, given = document(run, 1), recording()
    assert told["unreadable"] == [] and told["time_s"] == [round(state / 20, 4) for state in range(STEPS + 1)]
    moved, still = told["objects"]
    poses = np.array(moved["poses"]).reshape(-1, 7)
    np.testing.assert_allclose(poses[:, :3], given.object_positions_m[:, 0], atol=6e-5)
    assert len(still["poses"]) == 7 and [round(each, 3) for each in still["poses"][:3]] == [0.6, 0.1, 0.0]
    assert moved["label"] == "object_00 (can)" and get(run, moved["model"])[1][:4] == b"glTF"
    robot = load_robot("panda")
    model = pin.buildModelFromXML(robot.urdf)
    data = model.createData()
    for state in (0, 9, STEPS):
        q = pin.neutral(model)
        angles = [*given.joint_positions_rad[state], *[given.hand[state, 0] / 2] * 2]
        for joint, value in zip((*robot.arm_joints, *robot.finger_joints), angles, strict=True):
            q[model.joints[model.getJointId(joint)].idx_q] = value
        pin.framesForwardKinematics(model, data, q)
        for link in told["robots"][0]["links"]:
            pose = np.array(link["poses"]).reshape(-1, 7)
            expected = data.oMf[model.getFrameId(link["name"], pin.FrameType.BODY)]
            row = pose[min(state, len(pose) - 1)]
            np.testing.assert_allclose(row[:3], expected.translation, atol=1e-4)
            turned = pin.Quaternion(row[3], *row[4:]).matrix()
            np.testing.assert_allclose(turned, expected.rotation, atol=5e-4)
    assert (
        told["forces_n"][1][GRASPED] == 31.0
        and told["hands"][0]["values"][GRASPED] == 0.07
        and told["hands"][0]["is_opening"]
    )
    assert told["goal"][:3] == [0.45, 0.1, 0.0] and told["furniture"][0]["name"] == "board"
    assert [each["name"] for each in told["fixtures"]] == ["block"]


@pytest.mark.slow
def test_the_links_of_an_arm_come_as_one_small_file_by_their_numbers(run: Path) -> None:
    told = document(run)["robots"][0]
    status, body = get(run, told["model"])
    tree, _ = unpack_glb(body)
    names = {node["name"].partition("p")[0] for node in tree["nodes"]}
    assert status == 200 and len(body) < 2_000_000 and told["links"][0]["name"] == "panda_link0"
    assert names == {f"l{number}" for number in range(len(told["links"]))}


def test_the_robot_of_a_run_may_be_a_file_and_its_links_are_where_it_says(tmp_path: Path) -> None:
    """A link of the robot of boxes is one box: its corners in the GLB, Y up, are those of the URDF."""
    write_scenes(tmp_path)
    robot = boxy_robot(tmp_path)
    moved = moving(robot, STEPS, np.array([[0.5, 0.0, 0.0], [0.6, 0.2, 0.0]]))
    moved = replace(moved, action_tip_quaternion_wxyz=moved.tip_quaternion_wxyz[1:])
    one = stored(tmp_path, 0, moved)
    place = write_run(tmp_path, [replace(one, robot=recorded_robot(robot))])
    assert "none of the package" in document(place)["unreadable"][0]
    config = json.loads((place / "config.json").read_text())
    (place / "config.json").write_text(json.dumps({**config, "robot": str(tmp_path / "boxy.toml")}))
    told = document(place)["robots"][0]
    number = [each["name"] for each in told["links"]].index("upper")
    tree, _ = unpack_glb(get(place, told["model"])[1])
    mesh = next(each for each in tree["meshes"] if each["name"].startswith(f"l{number}p"))
    bounds = tree["accessors"][mesh["primitives"][0]["attributes"]["POSITION"]]
    np.testing.assert_allclose(
        [bounds["min"], bounds["max"]], [[0.075, -0.025, -0.025], [0.325, 0.025, 0.025]], atol=1e-6
    )
    turned = np.array(told["links"][number]["poses"]).reshape(-1, 7)
    np.testing.assert_allclose(turned[:, :3], np.tile([0.0, 0.0, 0.4], (STEPS + 1, 1)), atol=1e-4)
    angles = 2 * np.arctan2(turned[:, 6], turned[:, 3])
    np.testing.assert_allclose(angles, moved.joint_positions_rad[:, 0], atol=5e-4)


def test_two_arms_stand_where_their_bases_are_and_each_has_its_hand(tmp_path: Path) -> None:
    """The taker has the giver's joints, so that its links are the giver's turned about the vertical and 1.2 m away."""
    write_scenes(tmp_path)
    one = recording()
    beside = [
        each.name
        for each in fields(Recording)
        if each.name.startswith(("joint_", "tip_", "action_", "hand", "finger_"))
    ]
    twice = replace(one, **{name: np.hstack([getattr(one, name)] * 2) for name in beside})
    twice.finger_forces_n[:, :2] = 0  # the taker alone grasps
    robot = recorded_robot(load_robot("two_pandas"))
    place = write_run(tmp_path, [replace(stored(tmp_path, 0, twice), robot=robot)])
    told = document(place)
    assert told["unreadable"] == [] and [each["name"] for each in told["robots"]] == ["giver", "taker"]
    for first, second in zip(*(each["links"] for each in told["robots"]), strict=True):
        giver, taker = (np.array(each["poses"]).reshape(-1, 7)[:, :3] for each in (first, second))
        np.testing.assert_allclose(taker, giver * [-1, -1, 1] + [1.2, 0, 0], atol=2e-4)
    assert len(told["tips"]) == len(told["hands"]) == 2 and len(told["forces_n"]) == len(told["sides"]) == 4
    assert {"grasped object_00 (can) by the taker", "released object_00 (can) by the taker"} < {
        each["label"] for each in told["happenings"]
    }
    assert get(place, told["robots"][1]["model"].replace("arm=1", "arm=2"))[0] == 404


def test_a_long_episode_is_thinned_and_keeps_its_end_and_its_peaks(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    forces = recording().finger_forces_n.copy()
    forces[11, 0] = 99.0
    place = run_of(tmp_path, arrays={"finger_forces_n": forces})
    monkeypatch.setattr("manitwin.web.episode_document.MOST_STATES", 10)
    told = document(place)
    assert told["time_s"] == [0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.05, 1.2]
    assert told["forces_n"][0][4] == max(told["forces_n"][0]) == 99.0
    assert len(told["objects"][0]["poses"]) == 7 * 9 and told["tips"][0][-7:-4] == document(run)["tips"][0][-7:-4]
    monkeypatch.setattr("manitwin.web.episode_document.MOST_NUMBERS", 300)
    assert len(document(place)["time_s"]) == 4
