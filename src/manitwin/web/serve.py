"""Local page server of a data set, twin, scenes, episodes, reviews or outlines; runs until interrupted."""

from __future__ import annotations

import asyncio
import errno
import logging
import socket
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

import uvicorn
from starlette.types import ASGIApp

from manitwin.dataset.review.outlines import OutlineSession
from manitwin.dataset.review.session import ReviewSession
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.web.access import ENTER, Guard, ServerNames
from manitwin.web.application import application
from manitwin.web.episode_application import episode_application, missing_twins_application
from manitwin.web.episode_folders import EpisodeFolders, has_episodes
from manitwin.web.gallery_query import Gallery
from manitwin.web.outline_application import outline_application
from manitwin.web.review_application import review_application
from manitwin.web.scene_application import scene_application
from manitwin.web.scene_folders import SceneFolders, has_scenes
from manitwin.web.served_files import TwinFolders
from manitwin.web.tokens import Tokens
from manitwin.web.trial_player import TrialPlayer

MOST_REQUESTS = 256
"""Maximum number of concurrent requests; others get status 503."""
KEEP_ALIVE_S = 20
CLOSING_S = 2
"""Seconds to wait for open requests at shutdown."""
BETWEEN_LINKS_S = 2.0


def bound_socket(host: str, port: int) -> socket.socket:
    """Return a socket that listens on a host and port (0: any free port); raises UsageError on failure."""
    bare = host.strip("[]")
    try:
        found = socket.getaddrinfo(bare, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, kind, protocol, _, address = found[0]
        bound = socket.socket(family, kind, protocol)
    except (OSError, UnicodeError) as error:
        raise UsageError(
            f"--host {host}: is no address of this machine ({error}); give 127.0.0.1 or 0.0.0.0"
        ) from error
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
        bound.listen(128)
    except OSError as error:
        bound.close()
        if error.errno == errno.EADDRINUSE:
            raise UsageError(
                f"--port {port}: is taken by another program; give another, or 0 for any that is free"
            ) from error
        raise UsageError(
            f"--host {host} --port {port}: cannot be listened on ({error.strerror or error}); give another host or port"
        ) from error
    return bound


def _is_not_shutdown_message(record: logging.LogRecord) -> bool:
    """Keep a log record unless it is about requests that are cancelled at shutdown, which is intended."""
    cancelled = record.exc_info is not None and isinstance(record.exc_info[1], asyncio.CancelledError)
    return not cancelled and not str(record.msg).startswith("Cancel %s running task(s)")


logging.getLogger("uvicorn.error").addFilter(_is_not_shutdown_message)


class _Server(uvicorn.Server):
    """Leaves signal handling to the command; uvicorn would raise the signals again afterwards."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


class PageServer:
    """Server of guarded pages: ``link`` makes a one-time link, ``run`` serves until ``stop`` or an interrupt.

    ``on_new_link`` receives a new link after somebody opened a used one, at most one in two seconds. ``tokens`` are those of a
    previous server; port 0 then means its port if that is free, else any free port.
    """

    def __init__(
        self,
        app: ASGIApp,
        host: str,
        port: int,
        on_new_link: Callable[[str], None] | None = None,
        tokens: Tokens | None = None,
    ):
        self.tokens = Tokens() if tokens is None else tokens
        self.socket = (
            bound_socket(host, port) if port or not self.tokens.port else self._rebind_socket(host, self.tokens.port)
        )
        self.host, self.port = host.strip("[]"), int(self.socket.getsockname()[1])
        self.names = ServerNames.of(host, self.port)
        self.tokens.record_port(self.port)
        self._on_new_link, self._told = on_new_link, float("-inf")
        guard = Guard(app, self.names, self.tokens, self._replace_used_link)
        # Requests are not logged: their URLs contain tokens.
        config = uvicorn.Config(
            guard, log_config=None, access_log=False, lifespan="off", server_header=False, limit_concurrency=MOST_REQUESTS,
            timeout_keep_alive=KEEP_ALIVE_S, timeout_graceful_shutdown=CLOSING_S, ws="none",
        )  # fmt: skip
        self._server = _Server(config)

    @staticmethod
    def _rebind_socket(host: str, port: int) -> socket.socket:
        try:
            return bound_socket(host, port)
        except UsageError:  # another program uses it now
            return bound_socket(host, 0)

    def address(self) -> str:
        """Return the URL of the first page."""
        shown = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(self.host, self.host)
        return f"http://{f'[{shown}]' if ':' in shown else shown}:{self.port}"

    def link(self, onward: str = "/", person: str = "") -> str:
        """Return a one-time link that leads to a page."""
        return f"{self.address()}{ENTER}?token={self.tokens.link(person)}&next={quote(onward, safe='/')}"

    def run(self) -> None:
        """Serve until ``stop``, or until an interrupt, which is raised as KeyboardInterrupt."""
        asyncio.run(self._server.serve(sockets=[self.socket]))

    def stop(self) -> None:
        """Stop serving."""
        self._server.should_exit = True

    def _replace_used_link(self) -> None:
        now = asyncio.get_running_loop().time()
        if self._on_new_link is not None and now - self._told >= BETWEEN_LINKS_S:
            self._told = now
            self._on_new_link(self.link())


def application_for_place(
    place: str, cache: Path, twins: str | None = None, trials: TrialPlayer | None = None
) -> ASGIApp:
    """Return the pages of a data set, a twin's folder, scenes, or episodes whose twins are in the data set ``twins``.

    Raises UsageError for any other place or a missing index, and EpisodesError for an episode file that cannot be read.
    """
    if has_episodes(place):
        episodes = EpisodeFolders(place, cache, twins)
        title = Path(place).resolve().name
        if episodes.twins is None:
            return episode_application(missing_twins_application(episodes.without_twins), episodes, title)
        return episode_application(application(None, episodes.twins, title, trials), episodes, title)
    if twins is not None:
        raise UsageError(f"{place}: --twins is for episodes, and there are none")
    if has_scenes(place):
        scenes = SceneFolders(place, cache)
        title = Path(place).resolve().name
        return scene_application(application(None, scenes.twins, title, trials), scenes, title)
    shown_twins = TwinFolders(place, cache if "://" in place else None)
    if shown_twins.only is not None:
        only = shown_twins.only.record
        return application(None, shown_twins, only.name or only.twin_id, trials)
    root = DatasetRoot(place)
    return application(Gallery(root), shown_twins, Path(root.path).name or "twins", trials)


def review(
    place: str,
    session: ReviewSession,
    host: str,
    port: int,
    on_ready: Callable[[PageServer], None],
    on_used_link: Callable[[PageServer], None],
    tokens: Tokens,
) -> None:
    """Serve the pages of a review until interrupted; ``on_used_link`` is called when somebody opens a used link."""
    running: list[PageServer] = []
    with TrialPlayer() as trials:
        pages = application(None, twins := TwinFolders(place), "review", trials)
        app = review_application(pages, twins, session)
        server = PageServer(app, host, port, lambda _: on_used_link(running[0]), tokens)
        running.append(server)
        _run(server, on_ready)


def draw_outlines(
    session: OutlineSession,
    host: str,
    port: int,
    on_ready: Callable[[PageServer], None],
    on_new_link: Callable[[str], None],
) -> None:
    """Serve the outline drawing pages until interrupted; ``on_ready`` is called once the server listens."""
    _run(PageServer(outline_application(session), host, port, on_new_link), on_ready)


def serve(
    place: str,
    host: str,
    port: int,
    on_ready: Callable[[PageServer], None],
    on_new_link: Callable[[str], None],
    twins: str | None = None,
) -> None:
    """Serve the pages of ``pages_of`` until interrupted; ``on_ready`` is called once the server listens."""
    with tempfile.TemporaryDirectory(prefix="manitwin-view-") as cache, TrialPlayer() as trials:
        _run(PageServer(application_for_place(place, Path(cache), twins, trials), host, port, on_new_link), on_ready)


def _run(server: PageServer, on_ready: Callable[[PageServer], None]) -> None:
    try:
        on_ready(server)
        server.run()
    finally:
        server.socket.close()
