"""The rehearsal servers of grasps on the wire: messages, defaults and errors as those of the originals."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgpack_numpy
import numpy as np
import pytest
import zmq

from manitwin.engine.charges import REHEARSAL_MARK
from manitwin.errors import UsageError
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.grasp_servers import FakeGraspGen, FakeGraspGenX
from manitwin.models.fakes.message_server import MessageServer


def box_cloud(count: int = 400) -> np.ndarray:
    rng = np.random.default_rng(0)
    half = np.array([0.02, 0.03, 0.06])
    points = rng.uniform(-1, 1, (count, 3))
    axis = rng.integers(3, size=count)
    points[np.arange(count), axis] = np.sign(points[np.arange(count), axis])
    return (points * half).astype(np.float32)


CLOUD = box_cloud()
PANDA = {
    "extents_open": np.array([0.08, 0.018, 0.018], np.float32),
    "offset_open": np.array([0, 0, 0.1034], np.float32),
    "extents_mid": np.array([0.04, 0.018, 0.018], np.float32),
    "offset_mid": np.array([0, 0, 0.1034], np.float32),
}


@contextmanager
def connected(server: MessageServer) -> Iterator[Any]:
    """A client with the library that the originals' own clients use: asks one REQ socket as often as wanted."""
    context = zmq.Context()
    with server, context.socket(zmq.REQ) as socket:
        socket.linger, socket.rcvtimeo = 0, 10_000
        socket.connect(server.url)

        def ask(message: Any) -> Any:
            socket.send(msgpack_numpy.packb(message, use_bin_type=True))
            answer = msgpack_numpy.unpackb(socket.recv(), raw=False)
            assert answer.pop(REHEARSAL_MARK) is True, "every answer says that it is a rehearsal's"
            return answer

        yield ask
        socket.close()
    context.term()


def test_graspgen_answers_as_documented() -> None:
    with connected(FakeGraspGen()) as ask:
        assert ask({"action": "health"}) == {"status": "ok"}
        assert ask({"action": "metadata"}) == {
            "gripper_name": "franka_panda",
            "model_name": "diffusion-discriminator",
            "gripper_config": "/models/checkpoints/graspgen_franka_panda.yml",
        }
        answer = ask({"action": "infer", "point_cloud": CLOUD, "num_grasps": 30, "topk_num_grasps": 30})
    assert set(answer) == {"grasps", "confidences", "num_grasps", "timing"}
    assert answer["grasps"].shape == (30, 4, 4)
    assert answer["grasps"].dtype == answer["confidences"].dtype == np.float32
    assert answer["num_grasps"] == 30
    assert answer["confidences"].min() >= 0 and answer["confidences"].max() <= 1
    rotation = answer["grasps"][:, :3, :3].astype(float)
    assert np.linalg.det(rotation) == pytest.approx(1, abs=1e-5)


def test_graspgen_without_threshold_and_topk_gives_the_best_hundred() -> None:
    with connected(FakeGraspGen()) as ask:
        asked = {"action": "infer", "point_cloud": CLOUD, "num_grasps": 200}
        assert ask(asked)["num_grasps"] == 100
        assert ask(asked | {"topk_num_grasps": 150})["num_grasps"] == 150
        high = ask(asked | {"grasp_threshold": 0.9})
    assert 0 < high["num_grasps"] < 200
    assert high["confidences"].min() >= np.float32(0.9)


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ({"action": "fly"}, "Unknown action: fly"),
        ({}, "Unknown action: None"),
        ({"action": "infer"}, "Missing required field 'point_cloud'"),
        ({"action": "infer", "point_cloud": CLOUD[:, :2]}, "point_cloud must be (N, 3), got (400, 2)"),
        ({"action": "infer", "point_cloud": CLOUD, "num_grasps": "many"}, "invalid literal for int"),
        ([1, 2], "'list' object has no attribute 'get'"),
        ({"action": "infer", "point_cloud": np.array([None])}, "pickles, and are not read"),
    ],
)
def test_graspgen_says_what_it_cannot_do(message: Any, error: str) -> None:
    with connected(FakeGraspGen()) as ask:
        answer = ask(message)
        assert set(answer) == {"error"}
        assert error in answer["error"]
        assert ask({"action": "health"}) == {"status": "ok"}


def test_graspgen_finds_nothing_in_two_ways() -> None:
    with connected(FakeGraspGen(Faults({"no_grasps": 2}))) as ask:
        empty, error, grasps = (ask({"action": "infer", "point_cloud": CLOUD}) for _ in range(3))
    assert empty["grasps"].shape == (0, 4, 4)
    assert empty["confidences"].shape == (0,)
    assert empty["num_grasps"] == 0
    assert error == {"error": "expected Tensor as element 0 in argument 0, but got list"}
    assert grasps["num_grasps"] == 100


def test_the_same_cloud_gives_the_same_grasps() -> None:
    with connected(FakeGraspGen()) as ask:
        first, again = (ask({"action": "infer", "point_cloud": CLOUD})["grasps"] for _ in range(2))
        other = ask({"action": "infer", "point_cloud": box_cloud(500)})["grasps"]
    assert first.tobytes() == again.tobytes() != other.tobytes()


def test_grasps_close_around_the_cloud() -> None:
    with connected(FakeGraspGen()) as ask:
        answer = ask({"action": "infer", "point_cloud": CLOUD})
    poses = answer["grasps"][answer["confidences"] > 0.7].astype(float)
    assert len(poses) > 20
    local = np.einsum("nki,npk->npi", poses[:, :3, :3], CLOUD[None] - poses[:, None, :3, 3])
    between = (
        (np.abs(local[..., 0]) < 0.04) & (np.abs(local[..., 1]) < 0.009) & (np.abs(local[..., 2] - 0.1034) < 0.0093)
    )
    in_a_finger = (np.abs(np.abs(local[..., 0]) - 0.0475) < 0.0075) & (np.abs(local[..., 1]) < 0.00875)
    assert (between.sum(1) >= 2).mean() > 0.95
    assert not (in_a_finger & (local[..., 2] > 0.06) & (local[..., 2] < 0.1127)).any()


def test_graspgenx_answers_as_documented() -> None:
    with connected(FakeGraspGenX()) as ask:
        assert ask({"action": "health"}) == {"status": "ok"}
        metadata = ask({"action": "metadata"})
        asked = {"action": "infer_object", "point_cloud": CLOUD, "sweep_volume_params": PANDA, "num_grasps": 50}
        answer = ask(asked)
        flat = np.concatenate(list(PANDA.values()))
        assert ask(asked | {"sweep_volume_params": flat})["grasps"].tobytes() == answer["grasps"].tobytes()
    assert {"default_gripper", "loaded_grippers", "model", "assets_dir", "actions"} <= set(metadata)
    assert set(answer) == {"grasps", "confidences", "branch_tags", "timing"}
    assert answer["grasps"].shape == (50, 4, 4)
    assert answer["branch_tags"] == ["diff"] * 50


@pytest.mark.parametrize(
    ("changed", "error"),
    [
        ({"action": "fly"}, "ValueError: Unknown action: 'fly'"),
        ({"gripper_name": "franka_panda"}, "'gripper_name' is not accepted"),
        ({"grasp_threshold": 0.5}, "['grasp_threshold'] are not accepted"),
        ({"planner": "fast"}, "Unknown planner 'fast'"),
        ({"point_cloud": CLOUD[:0]}, "must be non-empty (N, 3)"),
        ({"sweep_volume_params": None}, "missing 'sweep_volume_params'"),
        ({"sweep_volume_params": PANDA | {"width": 1}}, "Unknown sweep_volume_params keys: ['width']"),
        ({"sweep_volume_params": {"extents_open": [1, 1, 1]}}, "missing keys"),
        ({"sweep_volume_params": PANDA | {"extents_mid": [0, 1, 1]}}, "extents_mid must be strictly positive"),
        ({"sweep_volume_params": PANDA | {"gripper_type": 7}}, "gripper_type must be 0, 1 or 2"),
    ],
)
def test_graspgenx_says_what_it_cannot_do(changed: dict[str, Any], error: str) -> None:
    with connected(FakeGraspGenX()) as ask:
        answer = ask({"action": "infer_object", "point_cloud": CLOUD, "sweep_volume_params": PANDA} | changed)
    assert error in answer["error"]


def test_faults_strike_work_and_not_the_state() -> None:
    with connected(FakeGraspGen(Faults.parse(["server_error"]))) as ask:
        assert ask({"action": "health"}) == {"status": "ok"}
        assert "out of memory" in ask({"action": "infer", "point_cloud": CLOUD})["error"]


def test_a_port_that_is_taken_is_a_usage_error() -> None:
    with FakeGraspGen() as server, pytest.raises(UsageError, match="give another with --port"):
        FakeGraspGen(port=int(server.url.rpartition(":")[2]))


def test_a_free_port_can_be_chosen() -> None:
    with FakeGraspGen() as server:
        port = int(server.url.rpartition(":")[2])
    with connected(FakeGraspGen(port=port)) as ask:
        assert ask({"action": "health"}) == {"status": "ok"}
