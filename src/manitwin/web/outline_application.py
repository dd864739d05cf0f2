"""Server pages for drawing object outlines: the list, a page per photo, its picture and its mask."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route

from manitwin.dataset.review.object_statements import name_remark, read_name
from manitwin.dataset.review.outlines import OutlineSession
from manitwin.errors import ManiTwinError, UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.web.application import LINKS, NOT_KEPT, PACKAGE_FILES, run_or_message
from manitwin.web.outline_page import MASK, NAME_PATH, PATH, PICTURE, list_page, next_address, outline_page
from manitwin.web.request_body import request_body

MOST_BODY_BYTES = 2 << 20
"""Limit on a request body: a PNG mask, in base64 if sent with words. A mask of 1024 x 1024 pixels takes about 20 kB, noise 130
kB.
"""
SENT = ("png", "name", "longest_side_cm")
"""Fields that a page sends to store: a base64 outline mask (null if none is drawn), and the typed values."""


def outline_application(session: OutlineSession) -> Starlette:
    """Return the pages of a session without the access guard."""

    async def show_list(request: Request) -> Response:
        return await run_or_message(lambda: HTMLResponse(list_page(session, LINKS), headers=NOT_KEPT))

    async def show(request: Request) -> Response:
        key = request.path_params["key"]
        return await run_or_message(
            lambda: HTMLResponse(outline_page(session, session.photo(key), LINKS), headers=NOT_KEPT)
        )

    async def give_picture(request: Request) -> Response:
        key = request.path_params["key"]
        return await run_or_message(lambda: Response(session.picture(key), media_type="image/webp", headers=NOT_KEPT))

    async def give_mask(request: Request) -> Response:
        key = request.path_params["key"]
        return await run_or_message(lambda: Response(session.mask(key), media_type="image/png", headers=NOT_KEPT))

    async def fit(request: Request) -> Response:
        key, png = request.path_params["key"], await request_body(request, MOST_BODY_BYTES)
        return await _json_response(
            lambda: Response(session.snap_mask(key, png), media_type="image/png", headers=NOT_KEPT)
        )

    async def keep(request: Request) -> Response:
        key, body = request.path_params["key"], await request_body(request, MOST_BODY_BYTES)

        def work() -> Response:
            sent = _parse_body(body, SENT)
            png = None if sent["png"] is None else _png(sent["png"])
            session.store_outline(key, png, sent["name"], sent["longest_side_cm"])
            return JSONResponse({"next": next_address(session, key), **vars(session.words(key))}, headers=NOT_KEPT)

        return await _json_response(work)

    async def tell_name(request: Request) -> Response:
        body = await request_body(request, MOST_BODY_BYTES)

        def work() -> Response:
            told = name_remark(read_name(_parse_body(body, ("name",))["name"]))
            return JSONResponse({"told": told}, headers=NOT_KEPT)

        return await _json_response(work)

    return Starlette(
        routes=[
            Route("/", show_list),
            Route(f"{PATH}/{{key}}", show),
            Route(f"{PATH}/{{key}}", keep, methods=["POST"]),
            Route(f"{PATH}/{{key}}/fit", fit, methods=["POST"]),
            Route(NAME_PATH, tell_name, methods=["POST"]),
            Route(f"{PATH}/{{key}}/{PICTURE}", give_picture),
            Route(f"{PATH}/{{key}}/{MASK}", give_mask),
            PACKAGE_FILES,
        ]
    )


def _parse_body(body: bytes, names: tuple[str, ...]) -> dict[str, Any]:
    """Return the body as an object; raises UsageError unless it has exactly these names."""
    sent = parse_json_object(body, "what was sent", UsageError, remedy="reload the page")
    if set(sent) != set(names):
        raise UsageError(f"what was sent has other names than {', '.join(names)}; reload the page")
    return sent


def _png(said: object) -> bytes:
    try:
        return base64.b64decode(said if isinstance(said, str) else "?", validate=True)
    except (ValueError, binascii.Error) as error:
        raise UsageError("what was sent is no outline in base64; reload the page") from error


async def _json_response(work: Callable[[], Response]) -> Response:
    """Run ``work`` in a thread and answer a script's request; errors are returned as JSON."""
    try:
        return await run_in_threadpool(work)
    except ManiTwinError as error:
        return JSONResponse({"error": str(error)}, 400, headers=NOT_KEPT)
