"""Local ZeroMQ message server in a thread, like those of grasp models: msgpack with numpy arrays.

The original servers use a REP socket, which must answer each request before it receives the next. This server uses a ROUTER
socket, which is compatible on the wire and can leave a request unanswered.
"""

from __future__ import annotations

import threading
from typing import Any, Protocol

import msgpack
import msgpack_numpy
import zmq

from manitwin.engine.charges import REHEARSAL_MARK
from manitwin.errors import UsageError
from manitwin.models.fakes.faults import Faults

NO_MESSAGE = b"\xc1 is no message"  # 0xc1 is the only byte that msgpack never uses
LISTEN_MS = 50


class MessageService(Protocol):
    """A service behind a message server."""

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """Answer a request; exceptions are turned into the service's own error."""
        ...

    def error(self, error: Exception) -> dict[str, Any]:
        """Return the service's own error message for an exception."""
        ...


class MessageServer:
    """Serve on this machine within the context; ``requests`` records the requests in order.

    Faults: ``hangs``, ``disconnects``, ``not_json``, ``cut_answer`` and ``server_error``, applied to ``infer...`` actions only;
    health and metadata are always answered.
    """

    def __init__(self, service: MessageService, faults: Faults | None = None, port: int = 0):
        """Listen on ``port`` (0: any free port); raises UsageError if it is in use."""
        self.requests = list[dict[str, Any]]()
        self._service, self._faults = service, faults or Faults()
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        try:
            self._socket = self._listen(f"tcp://127.0.0.1:{port or '*'}")
        except zmq.ZMQError as error:
            self._context.term()
            raise UsageError(f"port {port} cannot be used: {error}; give another with --port") from error
        self.url = str(self._socket.get_string(zmq.LAST_ENDPOINT)).rstrip("\0")
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> MessageServer:
        self._thread.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._stopped.set()
        self._thread.join()
        self._context.term()

    def _listen(self, address: str) -> zmq.Socket[bytes]:
        socket = self._context.socket(zmq.ROUTER)
        socket.linger = 0
        try:
            socket.bind(address)
        except zmq.ZMQError:
            socket.close()
            raise
        return socket

    def _serve(self) -> None:
        while not self._stopped.is_set():
            if not self._socket.poll(LISTEN_MS):
                continue
            *envelope, body = self._socket.recv_multipart()
            reply = self._reply(body)
            if reply is None:
                continue
            if reply == b"":
                self._reconnect()
            else:
                self._socket.send_multipart([*envelope, reply])
        self._socket.close()

    def _reconnect(self) -> None:
        """Drop all connections and listen again, like a restarted server."""
        self._socket.close()
        while not self._stopped.is_set():
            try:
                self._socket = self._listen(self.url)
                return
            except zmq.ZMQError:  # a closed port is freed with a delay
                self._stopped.wait(LISTEN_MS / 1000)

    def _reply(self, body: bytes) -> bytes | None:
        """Return the bytes of the answer; None to stay silent, empty to cut the connection."""
        try:
            request = msgpack.unpackb(body, raw=False, object_hook=_without_pickles)
            self.requests.append(request)
            if str(request.get("action")).startswith("infer"):
                return self._with_faults(request)
            answer = self._service.answer(request)
        except Exception as error:  # like the original servers, which report every exception in the answer
            answer = self._service.error(error)
        return _packed(answer)

    def _with_faults(self, request: dict[str, Any]) -> bytes | None:
        if self._faults.strike("hangs"):
            return None
        if self._faults.strike("disconnects"):
            return b""
        if self._faults.strike("not_json"):
            return NO_MESSAGE
        if self._faults.strike("server_error"):
            raise RuntimeError("CUDA out of memory. Tried to allocate 2.00 GiB")
        message = _packed(self._service.answer(request))
        return message[: len(message) // 2] if self._faults.strike("cut_answer") else message


def _packed(answer: dict[str, Any]) -> bytes:
    return msgpack.packb({**answer, REHEARSAL_MARK: True}, default=msgpack_numpy.encode, use_bin_type=True)


def _without_pickles(item: dict[Any, Any]) -> Any:
    if item.get(b"kind") == b"O":
        raise ValueError("arrays of objects are pickles, and are not read")
    return msgpack_numpy.decode(item)
