"""The pages of recorded episodes as the server gives them, without a browser: list, episode, document, and what they refuse."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pinocchio as pin
import pytest
from access_requests import asked

from boxy_robot import boxy_robot, moving
from drawn_episodes import (
    GRASPED,
    LIFTED,
    RELEASED,
    SET_DOWN,
    STEPS,
    attempt,
    recording,
    stored,
    write_batch,
    write_run,
)
from drawn_scenes import write_scenes
from manitwin.episodes.recording import Recording
from manitwin.episodes.stored_episode import StoredEpisode, recorded_robot
from manitwin.errors import EpisodesError, UsageError
from manitwin.formats.glb import unpack_glb
from manitwin.robots.load import load_robot
from manitwin.twin.dataset_root import twin_name
from manitwin.web.episode_document import DOCUMENT
from manitwin.web.episode_folders import is_episodes
from manitwin.web.plain_files import write_plain_files
from manitwin.web.serve import pages_of


def get(place: Path, path: str, twins: str | None = None) -> tuple[int, bytes]:
    messages = asked(pages_of(str(place), place.parent / "cache", twins), path)
    return messages[0]["status"], b"".join(each.get("body", b"") for each in messages[1:])


def document(place: Path, number: int = 0, twins: str | None = None) -> dict[str, Any]:
    status, body = get(place, f"/episode/{number}/{DOCUMENT}", twins)
    assert status == 200, body
    return dict(json.loads(body))


def run_of(root: Path, **changes: Any) -> Path:
    """A run of one episode with other arrays, facts or fields of its attempt."""
    write_scenes(root)
    arrays = changes.pop("arrays", {})
    return write_run(root, [stored(root, 0, replace(recording(), **arrays), **changes)])


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two kept episodes and two failed attempts before them; nothing may write there."""
    failed = (
        attempt(
            7, outcome="goal_missed", goal="in(object_00, object_01)", failure="in(object_00, object_01): on_the_rim"
        ),
        attempt(8, outcome="no_plan", plan_failures='{"approach_blocked": 5}', length_s=None),
    )
    return write_run(tmp_path_factory.mktemp("run"), failed=failed)


def test_the_list_has_every_attempt_with_its_reason_and_leads_to_the_recorded_ones(run: Path) -> None:
    assert is_episodes(str(run)) and is_episodes(str(run / "maniskill" / "trajectory.h5"))
    status, page = get(run, "/")
    assert status == 200 and b"2 recorded episodes of 4 attempts" in page
    assert b"on_the_rim" in page and b"5 approach blocked" in page and b"move the can to the left" in page
    assert page.count(b'href="/episode/') == 2 and b'<a href="/episode/1">episode-00000001</a>' in page
    page = get(run, "/?outcome=no_plan")[1]
    assert b"approach blocked" in page and b"on_the_rim" not in page and b"/episode/" not in page
    assert b"/episode/1" in get(run, "/?outcome=kept&from=x")[1]
    assert b"on_the_rim" in get(run, "/?outcome=nonsense")[1]


def test_a_run_of_failures_alone_says_why(tmp_path: Path) -> None:
    place = write_run(tmp_path, [], (attempt(3, outcome="no_plan", plan_failures='{"no_path": 4}'),))
    status, page = get(place, "/")
    assert status == 200 and b"0 recorded episodes of 1 attempts" in page and b"4 no path" in page
    assert get(place, "/episode/0")[0] == 404


def test_the_page_says_how_it_ended_and_leads_to_its_neighbours_and_twins(run: Path) -> None:
    status, page = get(run, "/episode/0")
    assert status == 200 and b'rel="next" href="/episode/1"' in page and b'rel="prev"' not in page
    assert b"succeeded, and nothing was touched" in page and b"put the can down further left" in page
    assert f'data-document="/episode/0/{DOCUMENT}"'.encode() in page
    twin = document(run)["objects"][0]["twin_id"]
    assert f'href="/twin/{twin}"'.encode() in page and get(run, f"/twin/{twin}")[0] == 200


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


def test_what_happens_is_found_in_the_recording_at_its_time(run: Path) -> None:
    found = {each["kind"]: each["time_s"] for each in document(run)["happenings"]}
    expected = {"grasped": GRASPED, "lifted": LIFTED, "set_down": SET_DOWN, "released": RELEASED}
    assert found == {kind: state / 20 for kind, state in expected.items()}
    phases = document(run)["phases"]
    assert phases[0]["label"] == "reach" and phases[-1]["to_s"] == STEPS / 20
    assert all(later["from_s"] - each["to_s"] == pytest.approx(0.05) for each, later in pairwise(phases))


def test_a_grip_that_is_lost_for_an_instant_is_one_grasp(tmp_path: Path) -> None:
    forces = recording().finger_forces_n.copy()
    forces[GRASPED + 3], forces[2:4] = 0, 9.0
    kinds = [each["kind"] for each in document(run_of(tmp_path, arrays={"finger_forces_n": forces}))["happenings"]]
    assert kinds.count("grasped") == kinds.count("released") == 1


def test_literals_events_granules_and_touches_are_told(tmp_path: Path) -> None:
    touched = np.zeros(STEPS + 1, bool)
    touched[12] = True
    held = np.zeros((STEPS + 1, 2), np.int16)
    held[:, 0], held[5:, 1] = 9, np.minimum(np.arange(STEPS - 4), 6)
    place = run_of(
        tmp_path,
        arrays={
            "unplanned_contact": touched,
            "active_literal": (np.arange(STEPS) >= 15).astype(np.uint8),
            "granules_in_objects": held,
            "granule_positions_m": np.full((STEPS + 1, 9, 3), 0.25, np.float32),
        },
        goal="in(object_00, object_01) and near(object_01, object_00, 0.1)",
        measured=json.dumps(
            [{"literal": "near(object_01)", "holds": False, "failure": "too_far", "measured": {"gap_m": 0.3}}]
        ),
        facts={
            "granule_radius_m": 0.004,
            "events": [
                {
                    "kind": "pressed",
                    "subject": "object_01",
                    "second": None,
                    "values": {"force_n": 6.2, "off_m": 0.0015, "time_s": 0.4},
                }
            ],
        },
    )
    told = document(place)
    said = [(each["time_s"], each["label"]) for each in told["happenings"]]
    assert (0.6, "the robot touched what it should not") in said
    assert (0.4, "pressed object_01 (box) (6.2 N, 1.5 mm off)") in said
    assert (0.75, "now: near(object_01, object_00, 0.1)") in said
    assert (0.3, "the first granule in object_01 (box)") in said and (0.55, "6 granules in object_01 (box)") in said
    assert [each["label"] for each in told["literals"]] == [
        "in(object_00, object_01)",
        "near(object_01, object_00, 0.1)",
    ]
    assert told["granules"]["count"] == 9 and set(told["granules"]["positions_m"]) == {0.25} and told["goal"] is None
    page = get(place, "/episode/0")[1]
    assert b"not true: too_far" in page and b"gap_m 0.3" in page


def test_what_is_grasped_is_what_the_literal_of_that_time_is_about(tmp_path: Path) -> None:
    place = run_of(
        tmp_path,
        arrays={"active_literal": (np.arange(STEPS) >= SET_DOWN + 1).astype(np.uint8)},
        goal="near(object_01, object_00, 0.1) and upright(object_00)",
    )
    told = [
        each["label"] for each in document(place)["happenings"] if each["kind"] in ("grasped", "lifted", "released")
    ]
    assert told == ["grasped object_01 (box)", "object_01 (box) leaves its support", "released object_01 (box)"]


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


def spoil(place: Path, array: str, change: Any) -> None:
    """Change an array of the first episode in the file, so that it could never have been written so."""
    with h5py.File(place / "maniskill" / "trajectory.h5", "r+") as file:
        content = file["traj_0"][array][()]
        del file["traj_0"][array]
        change(file["traj_0"], content)


def not_finite(group: h5py.Group, content: np.ndarray) -> None:
    content[3, 0] = np.nan
    group["obs/extra/tcp_pose"] = content


def no_rotation(group: h5py.Group, content: np.ndarray) -> None:
    content[3, 3:] = 0
    group["obs/extra/tcp_pose"] = content


def in_another_file(group: h5py.Group, content: np.ndarray) -> None:
    group["obs/extra/tcp_pose"] = h5py.ExternalLink("/etc/passwd", "/x")


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (not_finite, "is not finite"),
        (no_rotation, "not of length 1"),
        (in_another_file, "is a link"),
    ],
)
def test_a_broken_episode_says_so_in_one_line_and_leaves_the_others(tmp_path: Path, change: Any, cause: str) -> None:
    place = write_run(tmp_path)
    spoil(place, "obs/extra/tcp_pose", change)
    status, body = get(place, f"/episode/0/{DOCUMENT}")
    alert = body.decode().partition('role="alert">')[2].partition("</p>")[0]
    assert status == 422 and cause in alert and "\n" not in alert
    assert get(place, "/")[0] == get(place, "/episode/0")[0] == get(place, f"/episode/1/{DOCUMENT}")[0] == 200


def test_an_episode_of_more_bytes_than_the_limit_is_not_read(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with h5py.File(run / "maniskill" / "trajectory.h5") as file:
        sizes: list[int] = []
        file["traj_0"].visititems(
            lambda _, found: sizes.append(found.nbytes) if isinstance(found, h5py.Dataset) else None
        )
    monkeypatch.setattr("manitwin.web.episode_folders.MOST_EPISODE_BYTES", sum(sizes))
    assert get(run, f"/episode/0/{DOCUMENT}")[0] == 200
    monkeypatch.setattr("manitwin.web.episode_folders.MOST_EPISODE_BYTES", sum(sizes) - 1)
    status, body = get(run, f"/episode/0/{DOCUMENT}")
    assert status == 422 and f"{sum(sizes):,} bytes of arrays".encode() in body


def test_an_episode_that_says_nothing_of_itself_is_a_line_of_the_list(tmp_path: Path) -> None:
    place = write_run(tmp_path)
    with h5py.File(place / "maniskill" / "trajectory.h5", "r+") as file:
        file["traj_0"].attrs["episode"] = np.bytes_(b'{"attempt": 3}')
    (place / "attempts.parquet").unlink()
    page = get(place, "/")[1]
    assert page.count(b'class="error"') == 1 and b'href="/episode/1"' in page
    assert get(place, "/episode/0")[0] == 422 and get(place, "/episode/1")[0] == 200


def test_a_table_of_attempts_that_is_broken_or_another_runs_leaves_the_recorded_episodes(
    run: Path, tmp_path: Path
) -> None:
    shutil.copytree(run.parent, tmp_path / "copy")
    place = tmp_path / "copy" / "episodes"
    shutil.copy(write_run(tmp_path / "other", stored_ones(tmp_path / "other", 1)) / "attempts.parquet", place)
    page = get(place, "/")[1]
    assert b"tells of 1 recorded episodes, and there are 2" in page and b'href="/episode/1"' in page
    (place / "attempts.parquet").write_bytes(b"PAR1")
    assert b"no Parquet file" in get(place, "/")[1]


def stored_ones(root: Path, count: int) -> list[StoredEpisode]:
    write_scenes(root)
    return [stored(root, number) for number in range(count)]


def test_a_run_that_goes_on_shows_its_batches_and_a_broken_one_as_one_line(tmp_path: Path) -> None:
    first, second, third = stored_ones(tmp_path, 3)
    write_batch(tmp_path, [first, second], name="aabatch")
    place = write_batch(tmp_path, [third], name="bbbatch")
    assert is_episodes(str(place)) and [document(place, number)["number"] for number in range(3)] == [0, 1, 2]
    (place / "batches" / "aa" / "aabatch" / "episodes.h5").write_bytes(b"no HDF5")
    page = get(place, "/")[1]
    assert b"2 recorded episodes" in page and page.count(b'class="error"') == 1
    assert get(place, "/episode/0")[0] == 422 and document(place, 1)["episode_id"] == third.attempt.episode_id


def test_one_file_is_shown_with_the_twins_that_are_named(tmp_path: Path) -> None:
    made = write_run(tmp_path)
    file = tmp_path / "alone" / "some.h5"
    file.parent.mkdir()
    shutil.copy(made / "maniskill" / "trajectory.h5", file)
    told = document(file)
    assert all(each["model"] is None for each in told["objects"]) and "--twins" in told["unreadable"][0]
    assert get(file, "/static/stage.js")[0] == 200 and get(file, f"/twin/{told['objects'][0]['twin_id']}")[0] == 404
    told = document(file, twins=str(tmp_path / "set"))
    assert told["unreadable"] == [] and all(each["model"] for each in told["objects"])
    with pytest.raises(UsageError, match="--twins is for episodes"):
        pages_of(str(tmp_path / "scenes"), tmp_path / "cache", str(tmp_path / "set"))


def test_a_file_that_names_a_data_set_at_an_address_asks_nobody(tmp_path: Path) -> None:
    place = write_run(tmp_path)
    config = json.loads((place / "config.json").read_text())
    (place / "config.json").write_text(json.dumps({**config, "dataset": "https://127.0.0.1:9/set"}))
    told = document(place)
    assert "https://127.0.0.1:9/set" in told["unreadable"][0] and "--twins" in told["unreadable"][0]


def test_a_twin_that_is_gone_leaves_the_rest(tmp_path: Path) -> None:
    place = write_run(tmp_path)
    gone, other = (each["twin_id"] for each in document(place)["objects"])
    shutil.rmtree(tmp_path / "set" / twin_name(gone))
    told = document(place)
    assert len(told["unreadable"]) == 1 and gone in told["unreadable"][0]
    assert [each["model"] is None for each in told["objects"]] == [True, False] and other != gone


@pytest.mark.parametrize(
    ("of", "cause"),
    [({"name": "nobody"}, "none of the package"), ({"arm_joints": ("a",) * 7}, "other joints")],
)
def test_a_robot_that_is_not_known_leaves_the_objects(tmp_path: Path, of: dict[str, Any], cause: str) -> None:
    write_scenes(tmp_path)
    one = stored(tmp_path, 0)
    told = document(write_run(tmp_path, [replace(one, robot=replace(one.robot, **of))]))
    assert told["robots"] == [] and cause in told["unreadable"][0] and len(told["objects"][0]["poses"]) > 7


def test_facts_that_are_none_cost_their_own_part_only(tmp_path: Path) -> None:
    told = document(run_of(tmp_path, facts={"furniture": 3, "goal_object_to_world": "x"}))
    assert told["furniture"] == [] and told["goal"] is None and "facts.furniture" in told["unreadable"][0]


def test_words_of_an_episode_are_never_read_as_html(tmp_path: Path) -> None:
    hostile = "<script>alert(1)</script>\u202e"
    place = run_of(tmp_path, instructions=(hostile,), category=hostile, skill=hostile, goal=hostile, failure=hostile)
    for path in ("/", "/episode/0"):
        page = get(place, path)[1]
        assert b"<script>alert" not in page and b"&lt;script&gt;" in page and "\u202e".encode() not in page
    assert "\u202e" not in json.dumps(document(place), ensure_ascii=False)


def test_nothing_beside_the_episodes_is_given(run: Path) -> None:
    for path in (
        "/episode/..%2fconfig.json",
        "/episode/2",
        "/episode/-1",
        "/episode/99999999999",
        f"/episode/x/{DOCUMENT}",
        "/episode/0/trajectory.h5",
        "/config.json",
        "/maniskill/trajectory.h5",
        "/robot/..%2fconfig/links.glb",
        "/robot/boxy.toml/links.glb",
        "/robot/panda/visual.glb",
    ):
        assert get(run, path)[0] == 404, path


def test_a_file_that_leads_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    place = write_run(tmp_path)
    file = place / "maniskill" / "trajectory.h5"
    shutil.move(file, tmp_path / "elsewhere.h5")
    file.symlink_to(tmp_path / "elsewhere.h5")
    with pytest.raises(EpisodesError, match="leads out of the folder"):
        pages_of(str(place), tmp_path / "cache")


def test_plain_files_have_list_episodes_robot_and_twins_and_are_the_same_again(run: Path, tmp_path: Path) -> None:
    done = write_plain_files(str(run), tmp_path / "pages")
    files = {path.relative_to(tmp_path / "pages").as_posix(): path for path in (tmp_path / "pages").rglob("*.*")}
    assert (done.episodes, done.scenes, done.left_out) == (2, 0, {}) and done.twins >= 1
    assert done.size_bytes == sum(path.stat().st_size for path in files.values() if path.is_file())
    text = {name: path.read_text() for name, path in files.items() if path.suffix in (".html", ".js")}
    assert text["index.html"].count('href="episodes/') == 2 and "2 recorded episodes" in text["index.html"]
    page = text["episodes/1/index.html"]
    assert 'data-document="../../episodes/1/episode_view.json"' in page and 'href="../../episodes/0/index.html"' in page
    for named in re.findall(r'(?:src|href)="([^"#:]+)"', page):
        assert (tmp_path / "pages" / "episodes" / "1" / named).is_file(), named
    told = json.loads(text["episodes/1/episode_view.js"].split("=", 2)[2].rstrip(";\n"))
    [robot] = told["robots"]
    for model in (robot["model"], *(each["model"] for each in told["objects"])):
        script = text[f"{model.removeprefix('../../')}.js"]
        assert f'["{model.removeprefix("../../")}"]="' in script
    assert str(run) not in "".join(text.values()), "no folder of this machine"
    write_plain_files(str(run), tmp_path / "again")
    for name, path in files.items():
        assert path.is_dir() or (tmp_path / "again" / name).read_bytes() == path.read_bytes(), name


def test_plain_files_leave_out_an_episode_that_cannot_be_shown_whole(run: Path, tmp_path: Path) -> None:
    shutil.copytree(run, tmp_path / "run")
    (tmp_path / "empty").mkdir()
    done = write_plain_files(str(tmp_path / "run"), tmp_path / "none", twins=str(tmp_path / "empty"))
    assert done.episodes == done.twins == 0 and set(done.left_out) == {"episode 0", "episode 1"}
    assert "0 recorded episodes" in (tmp_path / "none" / "index.html").read_text()
    drawn = write_plain_files(str(run), tmp_path / "one", sample=1, seed=3)
    assert drawn.episodes == 1 and len(list((tmp_path / "one" / "episodes").iterdir())) == 1
    with pytest.raises(UsageError, match="--where"):
        write_plain_files(str(run), tmp_path / "where", where="mass_kg > 1")
    assert not (tmp_path / "where").exists()


def test_what_holds_no_episode_is_told(tmp_path: Path) -> None:
    (tmp_path / "batches").mkdir()
    with pytest.raises(UsageError, match="no recorded episode there"):
        pages_of(str(tmp_path), tmp_path / "cache")
    assert not is_episodes("s3://bucket/episodes") and not is_episodes(str(tmp_path / "nothing"))
    (tmp_path / "text.h5").write_text("text")
    with pytest.raises(EpisodesError, match="no HDF5 file"):
        pages_of(str(tmp_path / "text.h5"), tmp_path / "cache")
