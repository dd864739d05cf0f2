"""A TCP server whose every answer is a script of bytes, for clients that must bear anything."""

from __future__ import annotations

import socket
import socketserver
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

Converse = Callable[[socketserver.StreamRequestHandler], None]


@contextmanager
def tcp_server(converse: Converse) -> Iterator[str]:
    """Let ``converse`` speak with whoever connects, each in a thread of its own; gives ``127.0.0.1:PORT``."""

    class Handler(socketserver.StreamRequestHandler):
        def handle(self) -> None:
            try:
                converse(self)
            except OSError:
                return  # the client has gone away, as it should

    class Server(socketserver.ThreadingTCPServer):
        daemon_threads = True
        block_on_close = False

    with Server(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
        thread.start()
        try:
            yield f"127.0.0.1:{server.server_address[1]}"
        finally:
            with suppress(OSError):
                server.socket.shutdown(socket.SHUT_RDWR)  # or it looks at what is asked of it every 20 ms
            server.shutdown()
            thread.join()
