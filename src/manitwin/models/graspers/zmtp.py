"""Minimal ZeroMQ client: one request of a REQ socket and its answer, within a deadline and a size limit.

It implements ZMTP 3.0 (https://rfc.zeromq.org/spec/23/) with the mechanism NULL, which servers of version 3.1 also support.
libzmq limits the size of each frame of an answer (ZMQ_MAXMSGSIZE) but not their number, so a peer that sends endless frames
fills the memory until the timeout (measured: 70 MB per second). Here the limit applies to the sum of all frames.
"""

from __future__ import annotations

import socket
import struct
import time
from urllib.parse import urlsplit

from manitwin.models.services.addresses import addresses_of
from manitwin.models.services.connections import LONGEST_STEP_S

MORE, LONG, COMMAND = 1, 2, 4
_SIGNATURE = b"\xff" + bytes(8) + b"\x7f"
_GREETING = _SIGNATURE + b"\x03\x00" + b"NULL".ljust(20, b"\x00") + bytes(32)
_READY = b"\x05READY\x0bSocket-Type" + struct.pack(">I", 3) + b"REQ\x08Identity" + struct.pack(">I", 0)
_PIECE_BYTES = 65536
RETRY_S = 0.05


class ZmtpProtocolError(Exception):
    """The peer violates the protocol or exceeds the size limit; the message is meant for the user."""


class ZmtpConnectionError(Exception):
    """No connection could be made, so nothing was sent; the message says why."""


def ask(url: str, question: bytes, *, connect_s: float, timeout_s: float, max_bytes: int) -> bytes:
    """Send a message to the REP or ROUTER socket at ``tcp://HOST:PORT`` and return its answer.

    Raises NotConnected; TimeoutError after ``timeout_s`` in total; OSError for a lost connection; and NotZmtp for another
    protocol, an answer of several parts, or one of more than ``max_bytes``.
    """
    until = time.monotonic() + timeout_s
    with _connected(url, min(connect_s, timeout_s)) as connection:
        peer = _Peer(connection, until, max_bytes)
        peer.shake_hands()
        peer.send(b"", MORE)
        peer.send(question)
        return peer.answer()


def _connected(url: str, timeout_s: float) -> socket.socket:
    """Connect, with retries until the timeout, like libzmq, so that a restarting server is waited for."""
    parts = urlsplit(url)
    host, port, until = parts.hostname or "", parts.port or 0, time.monotonic() + timeout_s
    failure = "no address"
    try:
        addresses = addresses_of(host, port, timeout_s)
    except OSError as error:
        raise ZmtpConnectionError(str(error)) from None
    while (left := until - time.monotonic()) > 0:
        for address in addresses:
            try:
                return socket.create_connection((address, port), left)
            except OSError as error:
                failure = error.strerror or str(error)
        time.sleep(min(RETRY_S, left))
    raise ZmtpConnectionError(failure)


class _Peer:
    """A ZMTP connection with a deadline and a limit on the received bytes."""

    def __init__(self, connection: socket.socket, until: float, max_bytes: int):
        self._connection, self._until, self._left, self._max = connection, until, max_bytes, max_bytes

    def shake_hands(self) -> None:
        """Exchange greetings and READY commands."""
        self._write(_GREETING)
        greeting = self._read(64)
        if greeting[:1] != b"\xff" or greeting[9:10] != b"\x7f" or greeting[10] < 3:
            raise ZmtpProtocolError("it does not speak ZeroMQ (ZMTP 3)")
        mechanism = greeting[12:32].rstrip(b"\x00")
        if mechanism != b"NULL":
            raise ZmtpProtocolError("it asks for keys (ZeroMQ CURVE or PLAIN), which these servers do not")
        self.send(_READY, COMMAND)
        flags, body = self._frame()
        if not flags & COMMAND or not body.startswith(b"\x05READY"):
            raise ZmtpProtocolError("it refuses the connection")

    def send(self, body: bytes, flags: int = 0) -> None:
        """Send a frame."""
        length = len(body)
        head = bytes([flags, length]) if length < 256 else struct.pack(">BQ", flags | LONG, length)
        self._write(head + body)

    def answer(self) -> bytes:
        """Return the single part of the message after the empty delimiter frame; heartbeats are answered."""
        parts: list[tuple[int, bytes]] = []
        while not parts or parts[-1][0] & MORE:
            flags, body = self._frame()
            if not flags & COMMAND:
                parts.append((flags, body))
            elif body.startswith(b"\x04PING"):
                self.send(b"\x04PONG" + body[7:23], COMMAND)
            if len(parts) > 2:
                break
        if len(parts) != 2 or parts[0][1]:
            raise ZmtpProtocolError("its answer has not one part")
        return parts[1][1]

    def _frame(self) -> tuple[int, bytes]:
        flags = self._read(1)[0]
        if flags > LONG | COMMAND | MORE:
            raise ZmtpProtocolError("it does not speak ZeroMQ (ZMTP 3)")
        length = struct.unpack(">Q", self._read(8))[0] if flags & LONG else self._read(1)[0]
        return flags, self._read(length)

    def _read(self, length: int) -> bytes:
        self._left -= length + 1  # counts empty frames too
        if self._left < 0:
            raise ZmtpProtocolError(f"its answer has more than {self._max} bytes")
        data = bytearray()
        while len(data) < length:
            self._wait()
            piece = self._connection.recv(min(length - len(data), _PIECE_BYTES))
            if not piece:
                raise ConnectionError("the connection was cut")
            data += piece
        return bytes(data)

    def _write(self, data: bytes) -> None:
        view = memoryview(data)
        while view:
            self._wait()
            view = view[self._connection.send(view[:_PIECE_BYTES]) :]

    def _wait(self) -> None:
        left = self._until - time.monotonic()
        if left <= 0:
            raise TimeoutError
        self._connection.settimeout(min(left, LONGEST_STEP_S))
