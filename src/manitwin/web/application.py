"""Read-only server pages: gallery, twin pages, and the files that they refer to."""

from __future__ import annotations

from collections.abc import Callable

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import Receive, Scope, Send

from manitwin.errors import ManiTwinError, UsageError
from manitwin.web import trial_document
from manitwin.web.gallery_page import gallery_page
from manitwin.web.gallery_query import Gallery, View
from manitwin.web.html import page, text
from manitwin.web.links import ServerLinks
from manitwin.web.package_files import KINDS, package_file
from manitwin.web.served_files import ServedFile, TwinFolders, open_file
from manitwin.web.trial_player import TrialPlayer
from manitwin.web.twin_document import DOCUMENT, document_bytes, twin_document
from manitwin.web.twin_page import twin_page

LINKS = ServerLinks()
_KEPT = {"cache-control": "private, max-age=86400"}
"""Cache headers of files whose URL contains the revision."""
NOT_KEPT = {"cache-control": "no-store"}


def application(
    gallery: Gallery | None, twins: TwinFolders, title: str, trials: TrialPlayer | None = None
) -> Starlette:
    """Return the pages of a data set, or of one twin (``gallery`` None), without the access guard.

    ``trials`` plays grasp trials; the caller closes it.
    """
    player = TrialPlayer() if trials is None else trials

    async def show_gallery(request: Request) -> Response:
        if gallery is None:
            assert twins.only is not None
            return RedirectResponse(LINKS.twin(twins.only.record.twin_id), 303)
        return await run_or_message(lambda: _gallery(gallery, dict(request.query_params), title))

    async def show_twin(request: Request) -> Response:
        twin_id = request.path_params["twin_id"]
        return await run_or_message(lambda: _twin(twins, twin_id, gallery is not None))

    async def give_document(request: Request) -> Response:
        twin_id = request.path_params["twin_id"]
        return await run_or_message(
            lambda: Response(
                document_bytes(twin_document(twins.twin(twin_id))), media_type="application/json", headers=NOT_KEPT
            )
        )

    async def give_trial(request: Request) -> Response:
        twin_id, asked = request.path_params["twin_id"], request.query_params
        return await run_or_message(
            lambda: Response(
                player.play(twins.twin(twin_id), asked.get("gripper", ""), asked.get("grasp", "")),
                media_type="application/json",
                headers=NOT_KEPT,
            )
        )

    async def give_file(request: Request) -> Response:
        twin_id, name = request.path_params["twin_id"], request.path_params["name"]
        return await run_or_message(lambda: _FileResponse(open_file(twins.folder(twin_id), name)))

    return Starlette(
        routes=[
            Route("/", show_gallery),
            Route("/twin/{twin_id}", show_twin),
            Route(f"/twin/{{twin_id}}/{DOCUMENT}", give_document),
            Route(f"/twin/{{twin_id}}/{trial_document.DOCUMENT}", give_trial),
            Route("/twin/{twin_id}/{name:path}", give_file),
            PACKAGE_FILES,
        ]
    )


async def _give_package_file(request: Request) -> Response:
    name = request.path_params["name"]
    if name not in KINDS:
        return message_response(404, "There is no file of this name.")
    return Response(package_file(name), headers={"content-type": KINDS[name], "cache-control": "no-cache"})


PACKAGE_FILES = Route("/static/{name}", _give_package_file)
"""Styles and scripts of all pages."""


async def run_or_message(work: Callable[[], Response]) -> Response:
    """Run ``work`` in a thread and return its response. Errors are shown as a message page, so that a broken twin affects only
    its page.
    """
    try:
        return await run_in_threadpool(work)
    except UsageError as error:
        return message_response(404, str(error))
    except ManiTwinError as error:
        return message_response(422, str(error))


def _gallery(gallery: Gallery, asked: dict[str, str], title: str) -> Response:
    view = None
    try:
        view = View.from_url_fields(asked)
        return HTMLResponse(gallery_page(gallery.find(view), title, LINKS), headers=NOT_KEPT)
    except UsageError as error:
        # For an invalid condition, show all twins, the error, and the fields as entered.
        status = asked.get("status", "accepted")
        shown = gallery.find(View(status=status if status in ("accepted", "rejected") else "accepted"))
        page = gallery_page(shown, title, LINKS, error=str(error), asked=view)
        return HTMLResponse(page, 400, headers=NOT_KEPT)


def _twin(twins: TwinFolders, twin_id: str, with_gallery: bool) -> Response:
    return HTMLResponse(twin_page(twins.twin(twin_id), LINKS, with_gallery=with_gallery), headers=NOT_KEPT)


class _FileResponse(StreamingResponse):
    """Streams a file, and closes it even if the client disconnects early."""

    def __init__(self, file: ServedFile):
        headers = {"content-type": file.content_type, "content-length": str(file.size_bytes), **_KEPT}
        super().__init__(file.chunks(), headers=headers)
        self._file = file

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._file.stream.close()


def message_response(status: int, said: str) -> Response:
    """Return a page with a single message."""
    body = f'<main class="message"><p role="alert">{text(said)}</p><p><a href="{LINKS.gallery()}">The first page</a></p></main>\n'
    return HTMLResponse(page(str(status), body, LINKS), status, headers=NOT_KEPT)
