"""What becomes of a question when the server is down, busy, broken or hostile."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgpack
import msgpack_numpy
import numpy as np
import pytest
import zmq

from manitwin.config import ServicesConfig
from manitwin.engine.charges import record_charges
from manitwin.errors import BadReply, ConfigError, Unavailable
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.grasp_servers import FakeGraspGen
from manitwin.models.graspers import grasp_server
from manitwin.models.graspers.grasp_server import GraspServer, ServerError, pack, server_url, unpack

INFER = {"action": "infer", "point_cloud": np.zeros((0, 2), np.float32)}
SMALL = {"action": "infer", "point_cloud": np.random.default_rng(0).random((50, 3)).astype(np.float32)}


def server_at(url: str, timeout_s: float = 0.4, retries: int = 3, waits: list[float] | None = None) -> GraspServer:
    services = ServicesConfig(timeout_s=timeout_s, retries=retries)
    return GraspServer(url, "graspgen", services, [].append if waits is None else waits.append)


@contextmanager
def says(reply: bytes | None) -> Iterator[tuple[str, list[str]]]:
    """A server that answers everything with the same bytes, or nothing; gives its URL and the actions asked for."""
    context, stop, asked = zmq.Context(), threading.Event(), list[str]()
    socket = context.socket(zmq.ROUTER)
    socket.linger = 0
    port = socket.bind_to_random_port("tcp://127.0.0.1")

    def serve() -> None:
        while not stop.is_set():
            if socket.poll(20):
                *envelope, body = socket.recv_multipart()
                asked.append(msgpack.unpackb(body, raw=False)["action"])
                if reply is not None:
                    socket.send_multipart([*envelope, reply])
        socket.close()

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield f"tcp://127.0.0.1:{port}", asked
    finally:
        stop.set()
        thread.join()
        context.term()


def test_nothing_that_listens_is_said_at_once() -> None:
    waits: list[float] = []
    with pytest.raises(Unavailable, match=r"nothing listens at tcp://127.0.0.1:9; start its server"):
        server_at("tcp://127.0.0.1:9", timeout_s=0.1, waits=waits).ask({"action": "health"})
    assert waits == [1, 2, 4]


def test_a_question_that_was_not_answered_is_asked_again_on_a_new_socket() -> None:
    with FakeGraspGen(Faults({"hangs": 1})) as fake:
        answer = server_at(fake.url).ask(SMALL)
    assert answer["num_grasps"] == len(answer["grasps"])
    assert [request["action"] for request in fake.requests] == ["infer", "health", "infer"]


def test_a_server_that_was_restarted_is_asked_again() -> None:
    with FakeGraspGen(Faults({"disconnects": 1})) as fake:
        assert "grasps" in server_at(fake.url).ask(SMALL)


def test_a_busy_server_gets_the_work_once() -> None:
    waits: list[float] = []
    with says(None) as (url, asked), pytest.raises(Unavailable, match="busy or stuck"):
        server_at(url, timeout_s=0.2, waits=waits).ask(SMALL)
    assert asked == ["infer", "health", "health", "health"]
    assert waits == [1, 2, 4]


def test_no_retries_means_one_question() -> None:
    with FakeGraspGen(Faults({"hangs": 1})) as fake:
        with pytest.raises(Unavailable):
            server_at(fake.url, retries=0).ask(SMALL)
        assert "grasps" in server_at(fake.url, retries=0).ask(SMALL)  # nothing is stuck


def test_what_the_server_cannot_do_is_said_in_its_words() -> None:
    with FakeGraspGen(Faults({"server_error": 1})) as fake:
        with pytest.raises(ServerError, match=r"says: CUDA out of memory") as caught:
            server_at(fake.url).ask(SMALL)
        assert "\n" not in str(caught.value)
        with pytest.raises(BadReply, match=r"point_cloud must be \(N, 3\), got \(0, 2\)"):
            server_at(fake.url).ask(INFER)
    assert len(fake.requests) == 1 + 1  # an answer is an answer: not asked again


@pytest.mark.parametrize("fault", ["not_json", "cut_answer"])
def test_what_is_no_message_is_a_bad_reply(fault: str) -> None:
    with FakeGraspGen(Faults({fault: 1})) as fake, pytest.raises(BadReply, match="not a message"):
        server_at(fake.url).ask(SMALL)


def test_a_pickle_in_the_answer_is_not_run(tmp_path: Path) -> None:
    trap = tmp_path / "run"
    with says(hostile(trap)) as (url, _), pytest.raises(BadReply, match="not of plain numbers"):
        server_at(url).ask(SMALL)
    assert not trap.exists()


def test_an_answer_beyond_all_bounds_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grasp_server, "MAX_REPLY_BYTES", 1000)
    with says(msgpack.packb({"grasps": b"x" * 2000})) as (url, _), pytest.raises(BadReply, match="1000 bytes"):
        server_at(url, retries=0).ask(SMALL)


@pytest.mark.parametrize(
    ("argument", "url"),
    [
        ("", "tcp://localhost:5556"),
        ("@tcp://gpu.example:7000", "tcp://gpu.example:7000"),
        ("tcp://gpu.example", "tcp://gpu.example:5556"),
        ("@tcp://[::1]:7000", "tcp://[::1]:7000"),
    ],
)
def test_addresses(argument: str, url: str) -> None:
    assert server_url(argument, "graspgen") == url


@pytest.mark.parametrize("argument", ["franka", "franka@tcp://h:1", "@http://h:1", "@tcp://h:1/x", "@tcp://u:p@h:1"])
def test_what_is_no_address_is_a_configuration_error(argument: str) -> None:
    with pytest.raises(ConfigError):
        server_url(argument, "graspgen")


def test_a_rehearsal_says_that_it_is_one_and_a_server_does_not() -> None:
    with FakeGraspGen() as server, record_charges() as rehearsal:
        answer = server_at(server.url).ask({"action": "metadata"})
    assert rehearsal.rehearsed and not [name for name in answer if "rehearsal" in str(name)]
    with says(msgpack.packb({"gripper_name": "x"})) as (url, _), record_charges() as real:
        server_at(url).ask({"action": "metadata"})
    assert not real.rehearsed


class Touch:
    """What runs when it is unpickled: makes a file."""

    def __init__(self, path: Path):
        self.path = path

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return Path.touch, (self.path,)  # type: ignore[return-value]


def hostile(path: Path) -> bytes:
    payload = {b"nd": True, b"type": "|O", b"kind": b"O", b"shape": [1], b"data": pickle.dumps(Touch(path))}
    return msgpack.packb({"grasps": payload, "confidences": np.zeros(1).tolist()}, use_bin_type=True)


@pytest.mark.parametrize("dtype", ["<f4", "<f8", "<i4", "|u1", "|b1", ">f4"])
def test_arrays_travel_to_and_from_the_library_that_the_servers_use(dtype: str) -> None:
    values = np.arange(24).reshape(2, 3, 4).astype(dtype)
    theirs = msgpack_numpy.unpackb(pack({"action": "infer", "points": values}), raw=False)
    ours = unpack(msgpack_numpy.packb({"points": values, "one": np.float32(0.25)}, use_bin_type=True))
    for received in (theirs["points"], ours["points"]):
        assert received.dtype == values.dtype
        assert np.array_equal(received, values)
    assert ours["one"] == 0.25


def test_an_array_is_the_documented_map() -> None:
    message = msgpack.unpackb(pack({"a": np.array([[1.5]], np.float32)}), raw=False)
    assert message["a"] == {
        b"nd": True,
        b"type": "<f4",
        b"kind": b"",
        b"shape": [1, 1],
        b"data": np.float32(1.5).tobytes(),
    }


def test_pickles_are_refused_and_not_run(tmp_path: Path) -> None:
    trap = tmp_path / "run"
    with pytest.raises(ValueError, match="not of plain numbers"):
        unpack(hostile(trap))
    assert not trap.exists()
    msgpack_numpy.unpackb(hostile(trap), raw=False)  # the trap is one: the library falls into it
    assert trap.exists()


@pytest.mark.parametrize(
    "array",
    [
        {b"nd": True, b"type": "|O8", b"kind": b"", b"shape": [1], b"data": b"12345678"},
        {b"nd": True, b"type": [["x", "<f4"]], b"kind": b"V", b"shape": [1], b"data": b"1234"},
        {b"nd": True, b"type": "<f4", b"kind": b"", b"shape": [2, 2], b"data": b"1234"},
        {b"nd": True, b"type": "<f4", b"kind": b"", b"shape": "many", b"data": b"1234"},
        {b"nd": True, b"type": "no type", b"kind": b"", b"shape": [1], b"data": b"1234"},
        {b"nd": True, b"type": "<f4", b"kind": b"", b"shape": [1]},
        {b"nd": False, b"type": "<f4", b"data": b""},
    ],
)
def test_arrays_that_are_not_of_plain_numbers_are_no_message(array: dict[bytes, Any]) -> None:
    with pytest.raises(ValueError, match="not a message"):
        unpack(msgpack.packb({"grasps": array}))


@pytest.mark.parametrize(
    "data", [b"", b"\xc1", b"{}", b"\x81\xa1a", msgpack.packb([1]), msgpack.packb({1: 2}), b"\x91" * 3000]
)
def test_what_is_no_map_is_no_message(data: bytes) -> None:
    with pytest.raises(ValueError, match="not a"):
        unpack(data)
