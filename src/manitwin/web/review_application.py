"""Server pages of a review, personalized by the annotator that the guard has authenticated."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import Mount, Route
from starlette.types import ASGIApp, Receive, Scope, Send

from manitwin.dataset.review.session import ReviewSession
from manitwin.errors import ManiTwinError, UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.twin.loaded_twin import Twin
from manitwin.web import trial_document
from manitwin.web.access import PERSON
from manitwin.web.application import LINKS, message_response
from manitwin.web.request_body import request_body
from manitwin.web.review_page import PATH, done_page, review_page
from manitwin.web.served_files import INPUTS, VIEWS, TwinFolders
from manitwin.web.twin_document import DOCUMENT

MOST_BODY_BYTES = 64 << 10
_NOT_KEPT = {"cache-control": "no-store"}
_SHAPES = (DOCUMENT, trial_document.DOCUMENT, "visual.glb")


def review_application(pages: ASGIApp, twins: TwinFolders, session: ReviewSession) -> Starlette:
    """Return the pages of a review, falling back to ``pages`` of the twins; in a blind review only their pictures and shapes."""

    async def onward(request: Request) -> Response:
        return await _run_or_error(
            lambda: _redirect_to_next_twin(session, twins, _person(request), request.query_params.get("after"))
        )

    async def show(request: Request) -> Response:
        person, twin_id = _person(request), request.path_params["twin_id"]
        return await _run_or_error(lambda: _page(session, twins.twin(twin_id), person))

    async def confirm(request: Request) -> Response:
        person, twin_id, body = (
            _person(request),
            request.path_params["twin_id"],
            await request_body(request, MOST_BODY_BYTES),
        )

        def work() -> Response:
            session.confirm(person, _require_accepted(twins.twin(twin_id)).record, _parse_body(body, "review", person))
            return JSONResponse({"next": PATH}, headers=_NOT_KEPT)

        return await _run_or_error(work, as_json=True)

    async def draft(request: Request) -> Response:
        person, twin_id, body = (
            _person(request),
            request.path_params["twin_id"],
            await request_body(request, MOST_BODY_BYTES),
        )

        def work() -> Response:
            said = _parse_body(body, "draft", person)
            session.store.put_draft(person, _require_accepted(twins.twin(twin_id)).record.twin_id, said)
            return JSONResponse({}, headers=_NOT_KEPT)

        return await _run_or_error(work, as_json=True)

    async def undo(request: Request) -> Response:
        person, body = _person(request), await request_body(request, MOST_BODY_BYTES)

        def work() -> Response:
            undone = session.undo(person, str(_parse_body(body, "undo", person).get("request", "")))
            twin_id = None if undone is None else quote(undone.review.twin_id, safe="")
            return JSONResponse({"next": None if twin_id is None else f"{PATH}/{twin_id}"}, headers=_NOT_KEPT)

        return await _run_or_error(work, as_json=True)

    return Starlette(
        routes=[
            Route("/", lambda request: RedirectResponse(PATH, 303)),
            Route(PATH, onward),
            Route(f"{PATH}/undo", undo, methods=["POST"]),
            Route(f"{PATH}/{{twin_id}}", show),
            Route(f"{PATH}/{{twin_id}}", confirm, methods=["POST"]),
            Route(f"{PATH}/{{twin_id}}/draft", draft, methods=["POST"]),
            Mount("/", _BlindReviewFilter(pages) if session.blind else pages),
        ]
    )


class _BlindReviewFilter:
    """Serves shapes and pictures only, and hides pages and records with the origin and confidence of annotations."""

    def __init__(self, pages: ASGIApp):
        self._pages = pages

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        name = scope["path"].split("/", 3)[-1] if scope["path"].count("/") > 2 else ""
        shown = name in _SHAPES or name in INPUTS or VIEWS.fullmatch(name) or scope["path"].startswith("/static/")
        if shown:
            await self._pages(scope, receive, send)
        else:
            await Response("Not shown in a blind review.\n", 404, media_type="text/plain")(scope, receive, send)


def _person(request: Request) -> str:
    return str(request.scope.get(PERSON) or "")


def _redirect_to_next_twin(session: ReviewSession, twins: TwinFolders, person: str, after: str | None) -> Response:
    """Redirect to the first readable twin of the queue, so that an unreadable one does not block the others."""
    _require_known(session, person)
    unread: dict[str, str] = {}
    for twin_id in session.queue(person, after):
        try:
            _require_accepted(twins.twin(twin_id))
        except ManiTwinError as error:
            unread[twin_id] = str(error)
            continue
        return RedirectResponse(f"{PATH}/{quote(twin_id, safe='')}", 303, headers=_NOT_KEPT)
    return HTMLResponse(done_page(LINKS, person, session.progress(person), unread), headers=_NOT_KEPT)


def _page(session: ReviewSession, twin: Twin, person: str) -> Response:
    _require_known(session, person)
    twin_id = _require_accepted(twin).record.twin_id
    draft = session.store.draft(person, twin_id)
    if draft is None:
        stored = session.store.of_twin(twin_id, person)
        draft = None if stored is None else stored.review.model_dump(mode="json")
    if draft is not None and draft.get("revision") != twin.record.revision:
        draft = None  # it refers to another revision, whose points may lie elsewhere
    page = review_page(twin, LINKS, person, session.progress(person), draft, blind=session.blind)
    return HTMLResponse(page, headers=_NOT_KEPT)


def _require_accepted(twin: Twin) -> Twin:
    if twin.record.status != "accepted":
        raise UsageError(f"{twin.record.twin_id} was rejected, and only accepted twins are reviewed")
    return twin


def _require_known(session: ReviewSession, person: str) -> None:
    if person not in session.annotators:
        raise UsageError("this link is nobody's who reviews; open the one with your name")


def _parse_body(body: bytes, what: str, person: str) -> dict[str, Any]:
    """Return the body as an object; raises UsageError if it belongs to another annotator than the browser's cookie."""
    said = parse_json_object(body, what, UsageError)
    if said.pop("annotator", person) != person:
        raise UsageError(
            f"not saved: this browser has been {person}'s since their link was opened in it; open yours again"
        )
    return said


async def _run_or_error(work: Callable[[], Response], *, as_json: bool = False) -> Response:
    """Run ``work`` in a thread and return its response; errors are returned as text or JSON."""
    try:
        return await run_in_threadpool(work)
    except ManiTwinError as error:
        said: Any = {"error": str(error)}
        status = 400 if isinstance(error, UsageError) else 422
        if as_json:
            return JSONResponse(said, status, headers=_NOT_KEPT)
        return message_response(status, str(error))
