"""The server's pages for outlines that people draw: a list, a page for each photo, its picture and its mask."""

from __future__ import annotations

from collections.abc import Callable

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route

from manitwin.dataset.review.outlines import OutlineSession
from manitwin.errors import ManiTwinError
from manitwin.web.application import LINKS, NOT_KEPT, PACKAGE_FILES, answered
from manitwin.web.outline_page import MASK, PATH, PICTURE, list_page, next_address, outline_page
from manitwin.web.request_body import request_body

MOST_BODY_BYTES = 2 << 20
"""Of an outline as a PNG file: one of 1024 x 1024 pixels takes some 20 kB, of noise 130 kB."""


def outline_application(session: OutlineSession) -> Starlette:
    """Return the pages of a session, without the guard that belongs before them."""

    async def show_list(request: Request) -> Response:
        return await answered(lambda: HTMLResponse(list_page(session, LINKS), headers=NOT_KEPT))

    async def show(request: Request) -> Response:
        twin_id = request.path_params["twin_id"]
        return await answered(
            lambda: HTMLResponse(outline_page(session, session.photo(twin_id), LINKS), headers=NOT_KEPT)
        )

    async def give_picture(request: Request) -> Response:
        twin_id = request.path_params["twin_id"]
        return await answered(lambda: Response(session.picture(twin_id), media_type="image/webp", headers=NOT_KEPT))

    async def give_mask(request: Request) -> Response:
        twin_id = request.path_params["twin_id"]
        return await answered(lambda: Response(session.mask(twin_id), media_type="image/png", headers=NOT_KEPT))

    async def fit(request: Request) -> Response:
        twin_id, png = request.path_params["twin_id"], await request_body(request, MOST_BODY_BYTES)
        return await _told(lambda: Response(session.fitted(twin_id, png), media_type="image/png", headers=NOT_KEPT))

    async def keep(request: Request) -> Response:
        twin_id, png = request.path_params["twin_id"], await request_body(request, MOST_BODY_BYTES)

        def work() -> Response:
            session.keep(twin_id, png)
            return JSONResponse({"next": next_address(session, twin_id)}, headers=NOT_KEPT)

        return await _told(work)

    return Starlette(
        routes=[
            Route("/", show_list),
            Route(f"{PATH}/{{twin_id}}", show),
            Route(f"{PATH}/{{twin_id}}", keep, methods=["POST"]),
            Route(f"{PATH}/{{twin_id}}/fit", fit, methods=["POST"]),
            Route(f"{PATH}/{{twin_id}}/{PICTURE}", give_picture),
            Route(f"{PATH}/{{twin_id}}/{MASK}", give_mask),
            PACKAGE_FILES,
        ]
    )


async def _told(work: Callable[[], Response]) -> Response:
    """Answer a script from a thread; what a person can mend is said in words."""
    try:
        return await run_in_threadpool(work)
    except ManiTwinError as error:
        return JSONResponse({"error": str(error)}, 400, headers=NOT_KEPT)
