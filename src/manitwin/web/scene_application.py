"""Server pages of scenes: the list, a 3D view of each scene, and the pages and files of their twins."""

from __future__ import annotations

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import Mount, Route
from starlette.types import ASGIApp

from manitwin.errors import UsageError
from manitwin.scenes.scene import SceneRecord
from manitwin.web.application import LINKS, NOT_KEPT, run_or_message
from manitwin.web.scene_document import DOCUMENT, scene_document
from manitwin.web.scene_folders import SceneFolders
from manitwin.web.scene_pages import PAGE_SCENES, list_page, scene_page
from manitwin.web.twin_document import document_bytes


def scene_application(pages: ASGIApp, scenes: SceneFolders, title: str) -> Starlette:
    """Return the pages of scenes, falling back to ``pages`` of their twins, without the access guard."""

    async def show_list(request: Request) -> Response:
        if len(scenes.ids) == 1:
            return RedirectResponse(LINKS.scene(scenes.ids[0]), 303)
        return await run_or_message(lambda: _list(scenes, request.query_params.get("from", "0"), title))

    async def show_scene(request: Request) -> Response:
        scene_id = request.path_params["scene_id"]
        return await run_or_message(lambda: _scene(scenes, scene_id))

    async def give_document(request: Request) -> Response:
        scene_id = request.path_params["scene_id"]
        return await run_or_message(
            lambda: Response(
                document_bytes(scene_document(scenes.scene(scene_id), scenes.twins, LINKS)),
                media_type="application/json",
                headers=NOT_KEPT,
            )
        )

    return Starlette(
        routes=[
            Route("/", show_list),
            Route("/scene/{scene_id}", show_scene),
            Route(f"/scene/{{scene_id}}/{DOCUMENT}", give_document),
            Mount("/", pages),
        ]
    )


def _list(scenes: SceneFolders, start: str, title: str) -> Response:
    count = len(scenes.ids)
    place = int(start) if start.isascii() and start.isdigit() and len(start) < 10 else 0
    place = place - place % PAGE_SCENES if place < count else 0
    shown = [_read(scenes, scene_id) for scene_id in scenes.ids[place : place + PAGE_SCENES]]
    return HTMLResponse(list_page(shown, place, count, title, LINKS), headers=NOT_KEPT)


def _read(scenes: SceneFolders, scene_id: str) -> SceneRecord | str:
    try:
        return scenes.scene(scene_id)
    except UsageError as error:  # a broken scene affects only its own line
        return str(error)


def _scene(scenes: SceneFolders, scene_id: str) -> Response:
    record = scenes.scene(scene_id)
    return HTMLResponse(scene_page(record, LINKS, *scenes.neighbours(scene_id)), headers=NOT_KEPT)
