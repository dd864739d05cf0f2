"""Client of a grasp server over ZeroMQ: one message each way, each request on its own connection.

A server handles one request at a time and queues others, so a busy server does not answer. Messages are msgpack with numpy
arrays in the format of the library msgpack-numpy: a map with the binary keys ``nd``, ``type``, ``kind``, ``shape`` and
``data``. msgpack-numpy itself calls ``pickle.loads`` on arrays of kind ``O`` (``decode``, version 0.4.8), which would let a
server execute any code. Answers are therefore decoded here, and only arrays of plain numbers are accepted.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import msgpack
import msgpack_numpy
import numpy as np

from manitwin.config import ServicesConfig
from manitwin.engine.charges import REHEARSAL_MARK, note_rehearsal
from manitwin.errors import BadReply, ConfigError, Unavailable
from manitwin.models.graspers import zmtp
from manitwin.models.services.keys import redacted, split_url

DEFAULT_URL = "tcp://localhost:5556"  # port in the documentation of both servers
CONNECT_TIMEOUT_S = 5.0
MAX_REPLY_BYTES = 8 << 20  # 4,000 grasps take 0.3 MB, or 0.6 MB as lists of doubles
FIRST_PAUSE_S = 1.0
PLAIN_KINDS = "biuf"
"""Numpy type kinds whose bytes are the numbers themselves: bool, integers, floats."""


class ServerError(BadReply):
    """The server reported an error; ``detail`` is its message."""

    def __init__(self, message: str, detail: str = ""):
        super().__init__(message)
        self.detail = detail

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        return type(self), (str(self), self.detail)


def server_url(argument: str, what: str) -> str:
    """Return the URL given by an argument, by default ``tcp://localhost:5556``; raises ConfigError for an invalid one."""
    model, url = split_url(argument)
    if model or (argument and url is None):
        raise ConfigError(f"{what} takes only the address of its server: {what}@tcp://HOST:5556; it is {argument!r}")
    parts = urlsplit(url or DEFAULT_URL)
    if parts.scheme != "tcp" or parts.path:
        raise ConfigError(f"{what}: {url} is not a ZeroMQ address; give tcp://HOST:5556")
    return f"tcp://{parts.netloc}" if parts.port else f"tcp://{parts.netloc}:5556"


class GraspServer:
    """Client of the grasp server at ``url``; ``what`` names the server in messages."""

    def __init__(self, url: str, what: str, services: ServicesConfig, sleep: Callable[[float], None] = time.sleep):
        self.url, self.what, self._services, self._sleep = url, what, services, sleep

    def ask(self, question: dict[str, Any]) -> dict[str, Any]:
        """Return the answer; raises Unavailable if there is none after all retries, BadReply if it is not a valid message.

        After a timeout the request may still be in the server's queue. It is sent again only after the server has answered
        ``health``, so that a busy server does not get the same work repeatedly.
        """
        pause_s = FIRST_PAUSE_S
        for left in range(self._services.retries, -1, -1):
            try:
                if left < self._services.retries:
                    self._exchange({"action": "health"})
                return self._exchange(question)
            except Unavailable:
                if not left:
                    raise
            self._sleep(pause_s)
            pause_s *= 2
        raise AssertionError("the last try returns or raises")

    def _exchange(self, question: dict[str, Any]) -> dict[str, Any]:
        """Send one request and return its answer; translates transport errors to Unavailable and BadReply."""
        timeout_s = self._services.timeout_s
        try:
            reply = zmtp.ask(
                self.url,
                pack(question),
                connect_s=CONNECT_TIMEOUT_S,
                timeout_s=timeout_s,
                max_bytes=MAX_REPLY_BYTES,
            )
        except zmtp.ZmtpConnectionError as error:
            raise Unavailable(f"{self.what}: nothing listens at {self.url}; start its server ({error})") from None
        except zmtp.ZmtpProtocolError as error:
            raise BadReply(
                f"{self.what}: the server at {self.url} cannot be used: {error}; check what runs there"
            ) from None
        except TimeoutError:
            raise Unavailable(
                f"{self.what}: no answer from {self.url} within {timeout_s:g} s: it is busy or stuck;"
                " run again later, or raise services.timeout_s"
            ) from None
        except OSError as error:
            raise Unavailable(
                f"{self.what}: {self.url} cut the connection ({error.strerror or error}); run again later"
            ) from None
        return self._read(reply)

    def _read(self, reply: bytes) -> dict[str, Any]:
        """Decode an answer; raises BadReply if it is invalid, ServerError if it reports an error."""
        try:
            answer = unpack(reply)
        except ValueError as error:
            raise BadReply(f"{self.what}: the answer of {self.url} is {redacted(str(error), None)}") from error
        if answer.pop(REHEARSAL_MARK, None):
            note_rehearsal()
        if "error" in answer:
            detail = said(answer["error"])
            raise ServerError(f"{self.what}: the server at {self.url} says: {detail}", detail)
        return answer


def said(value: Any) -> str:
    """Return a value of an answer as one short printable line."""
    return redacted(str(value), None)


def pack(message: dict[str, Any]) -> bytes:
    """Encode a message."""
    return msgpack.packb(message, default=msgpack_numpy.encode, use_bin_type=True)


def unpack(data: bytes) -> dict[str, Any]:
    """Decode a message; raises ValueError if it is invalid or contains an array that is not of plain numbers."""
    try:
        message = msgpack.unpackb(data, raw=False, object_hook=_array_of)
    except (msgpack.UnpackException, ValueError, TypeError, LookupError, ArithmeticError, SyntaxError) as error:
        raise ValueError(f"not a message of msgpack: {str(error) or type(error).__name__}") from error
    if not isinstance(message, dict):
        raise ValueError(f"not a map, but {type(message).__name__}")
    return message


def _array_of(item: dict[Any, Any]) -> Any:
    if b"nd" not in item:
        return item
    kind, name = item.get(b"kind", b""), item[b"type"]
    if kind != b"" or not isinstance(name, str) or np.dtype(name).kind not in PLAIN_KINDS:
        raise ValueError(f"an array of kind {kind!r} and type {name!r}, which is not of plain numbers")
    values = np.frombuffer(item[b"data"], np.dtype(name))
    return values.reshape(item[b"shape"]) if item[b"nd"] else values[0]
