"""Both grasp clients against servers that lie: on the wire of ZeroMQ, and in each part of each good answer."""

from __future__ import annotations

import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import msgpack
import numpy as np
import pytest
import trimesh

from manitwin.config import ServicesConfig
from manitwin.errors import BackendError, BadReply, Unavailable
from manitwin.models.fakes.grasp_servers import FakeGraspGen, FakeGraspGenX
from manitwin.models.graspers import grasp_server
from manitwin.models.graspers.grasp_server import GraspServer, unpack
from manitwin.models.graspers.graspgen import GraspGenGrasper
from manitwin.models.graspers.graspgenx import GraspGenXGrasper
from manitwin.models.graspers.protocol import GraspRequest
from manitwin.robots.grippers.gripper import load_gripper
from raw_server import tcp_server

Write = Callable[[bytes], None]
Read = Callable[[int], bytes]
GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(20, b"\x00") + bytes(32)
READY = b"\x05READY\x0bSocket-Type" + struct.pack(">I", 3) + b"REP\x08Identity" + struct.pack(">I", 0)
SERVERS = {"graspgen": FakeGraspGen, "graspgenx": FakeGraspGenX}


@contextmanager
def raw(script: Callable[[Read, Write], None]) -> Iterator[str]:
    """Serve a script of bytes to whoever connects; gives the URL."""

    with tcp_server(lambda connection: script(connection.rfile.read, connection.connection.sendall)) as address:
        yield f"tcp://{address}"


def asked(url: str, timeout_s: float = 20.0) -> Any:
    """Ask a server for its health, once."""
    return GraspServer(url, "graspgen", ServicesConfig(timeout_s=timeout_s, retries=0)).ask({"action": "health"})


def frame(body: bytes, flags: int = 0) -> bytes:
    return struct.pack(">BQ", flags | 2, len(body)) + body


def after_greeting(*parts: bytes, again: bytes = b"") -> Callable[[Read, Write], None]:
    """Return a script that greets, says ``parts``, and then ``again`` without end."""

    def script(read: Read, write: Write) -> None:
        write(GREETING)
        read(64)
        write(frame(READY, 4))
        for part in parts:
            write(part)
        while again:
            write(again)
        read(1_000_000)

    return script


def greeting(data: bytes) -> Callable[[Read, Write], None]:
    def script(read: Read, write: Write) -> None:
        write(data)
        read(1_000_000)

    return script


FINE = msgpack.packb({"status": "ok"})
HOSTILE: dict[str, Callable[[Read, Write], None]] = {
    "parts without end": after_greeting(b"\x01\x00", again=frame(b"y" * 50_000, 1)),
    "empty parts without end": after_greeting(again=b"\x01\x00" * 1000),
    "heartbeats without end": after_greeting(again=frame(b"\x04PING\x00\x00", 4) * 100),
    "a frame of 2^63 bytes": after_greeting(b"\x01\x00", struct.pack(">BQ", 2, 1 << 63), again=b"y" * 4096),
    "a frame that is too long": after_greeting(b"\x01\x00", frame(b"y" * 200_000)),
    "no delimiter": after_greeting(frame(FINE)),
    "a delimiter that is none": after_greeting(frame(b"x", 1), frame(FINE)),
    "unknown flags": after_greeting(b"\xf0\x00"),
    "an error instead of READY": greeting(GREETING + frame(b"\x05ERROR\x02no", 4)),
    "HTTP": greeting(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n" + b" " * 100),
    "an old ZeroMQ": greeting(b"\xff" + bytes(8) + b"\x7f\x01" + bytes(60)),
    "keys": greeting(GREETING.replace(b"NULL" + bytes(1), b"CURVE")),
    "an end": lambda read, write: None,
    "an end after the greeting": lambda read, write: write(GREETING),
}


@pytest.mark.parametrize("what", sorted(HOSTILE))
def test_what_is_no_answer_on_the_wire_is_said_in_one_line(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grasp_server, "MAX_REPLY_BYTES", 100_000)
    with raw(HOSTILE[what]) as url, pytest.raises(BadReply if " end" not in f" {what}" else BackendError) as caught:
        asked(url)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 400
    if "frame" in what or what in ("parts without end", "heartbeats without end"):
        assert "100000 bytes" in str(caught.value)


def test_server_that_drips_is_left_at_the_end_of_the_time() -> None:
    stop = threading.Event()

    def drip(read: Read, write: Write) -> None:
        after = GREETING + frame(READY, 4) + b"\x01\x00" + frame(FINE + bytes(10_000))
        for at in range(len(after)):
            if stop.wait(0.02 if at > 100 else 0):
                return
            write(after[at : at + 1])

    with raw(drip) as url, pytest.raises(Unavailable, match=r"within 0\.5 s"):
        asked(url, timeout_s=0.5)
    stop.set()


def test_heartbeats_between_the_parts_are_answered() -> None:
    def whole(read: Read, write: Write) -> None:
        write(GREETING + frame(READY, 4) + frame(b"\x04PING\x00\x0abeat", 4) + b"\x01\x00" + frame(FINE))
        read(1_000_000)

    with raw(whole) as url:
        assert asked(url) == {"status": "ok"}


ARRAY = {b"nd": True, b"type": "<f4", b"kind": b"", b"shape": [1, 4, 4], b"data": bytes(64)}
ODD: dict[str, Any] = {
    "null": None,
    "text": "\x1b[31m\u202etext",
    "list": [[[]]],
    "object": {"a": {}},
    "negative": -1,
    "huge": 2**64 - 1,
    "true": True,
    "not a number": float("nan"),
    "bytes": b"\xff\x00",
    "ragged": [[1.0], [1.0, 2.0]],
    "nan": ARRAY | {b"data": np.full(16, np.nan, "<f4").tobytes()},
    "huge floats": ARRAY | {b"data": np.full(16, 3e38, "<f4").tobytes()},
    "far": np.diag([1.0, 1, 1, 1])[None] + 1e300 * (np.arange(16).reshape(1, 4, 4) == 3),
    "scaled": ARRAY | {b"data": np.tile(np.float32(7), 16).tobytes()},
    "shape": ARRAY | {b"shape": [-1, 2**40]},
    "no shape": ARRAY | {b"shape": [0, 2**62, 2**62]},
    "type": ARRAY | {b"type": "(1000000000,)f8"},
    "type of dates": ARRAY | {b"type": "<M8[ns]"},
    "type without end": ARRAY | {b"type": "f4," * 10_000},
    "type of texts": ARRAY | {b"type": "U999999999999"},
}
QUICK = ("far", "huge", "nan", "null", "object", "shape", "text", "type without end")
"""The kinds that differ most; all others are tried by the slow tests."""


@cache
def request_for_a_box() -> GraspRequest:
    solid = trimesh.creation.box((0.05, 0.05, 0.1))
    corners = np.asarray(solid.vertices)
    return GraspRequest(solid, (corners,), 0.2, np.zeros(3), 0.5, load_gripper("panda"), np.empty((0, 3)), 20, seed=0)


def grasper(name: str, url: str) -> Any:
    client = GraspServer(url, name, ServicesConfig(timeout_s=60.0, retries=0))
    return GraspGenGrasper(client, "franka_panda") if name == "graspgen" else GraspGenXGrasper(client)


@cache
def good_answers(name: str) -> dict[str, dict[str, Any]]:
    """What the fake answers to each action in a use that goes well."""
    good = dict[str, dict[str, Any]]()
    with SERVERS[name]() as server:
        genuine = server.answer

        def kept(request: dict[str, Any]) -> dict[str, Any]:
            answer = genuine(request)
            return good.setdefault(request["action"], answer)

        server.answer = kept  # type: ignore[method-assign]
        asking = grasper(name, server.url)
        assert asking.probe() and len(asking.propose(request_for_a_box()).score)
    return good


@pytest.mark.parametrize(
    "kind", [kind if kind in QUICK else pytest.param(kind, marks=pytest.mark.slow) for kind in sorted(ODD)]
)
@pytest.mark.parametrize("name", sorted(SERVERS))
def test_each_part_of_each_good_answer_replaced_by_another_kind(name: str, kind: str) -> None:
    good = good_answers(name)
    with SERVERS[name]() as server:
        for action, part in [(action, part) for action, answer in good.items() for part in answer]:
            lies = good | {action: good[action] | {part: ODD[kind]}}
            server.answer = lambda request, lies=lies: lies[request["action"]]  # type: ignore[method-assign]
            asking = grasper(name, server.url)
            uses = [asking.probe] if action == "health" else [asking.probe, lambda: asking.propose(request_for_a_box())]  # noqa: B023
            for use in uses[action.startswith("infer") :]:
                try:
                    made = use()
                except BackendError as error:
                    assert str(error).isprintable() and len(str(error)) < 600, ascii(str(error))
                else:
                    assert made.isprintable() if isinstance(made, str) else np.isfinite(made.score).all()


@pytest.mark.parametrize(
    "data", [b"\x91" * 100_000, b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff", b"\xc6\xff\xff\xff\xff"]
)
def test_message_that_promises_more_than_it_holds_is_no_message(data: bytes) -> None:
    with pytest.raises(ValueError, match="not a message"):
        unpack(data)
