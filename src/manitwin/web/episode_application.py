"""Server pages of recorded episodes: the list, a 3D view of each, and the pages and files of their twins."""

from __future__ import annotations

from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Mount, Route
from starlette.types import ASGIApp

from manitwin.episodes.attempts import OUTCOMES
from manitwin.errors import EpisodesError, UsageError
from manitwin.robots.robot import Robot
from manitwin.web.application import LINKS, NOT_KEPT, PACKAGE_FILES, message_response, run_or_message
from manitwin.web.attempt_rows import AttemptRow
from manitwin.web.episode_document import DOCUMENT, episode_document
from manitwin.web.episode_folders import EpisodeFolders
from manitwin.web.episode_pages import PAGE_EPISODES, EpisodeList, episode_page, list_page, recorded_row
from manitwin.web.robot_model import robot_glb
from manitwin.web.twin_document import document_bytes


def episode_application(pages: ASGIApp, episodes: EpisodeFolders, title: str) -> Starlette:
    """Return the pages of episodes, falling back to ``pages`` of their twins, without the access guard."""

    async def show_list(request: Request) -> Response:
        asked = request.query_params
        return await run_or_message(lambda: _list(episodes, asked.get("from", "0"), asked.get("outcome", ""), title))

    async def show_episode(request: Request) -> Response:
        return await run_or_message(lambda: _episode(episodes, _number(request)))

    async def give_document(request: Request) -> Response:
        return await run_or_message(lambda: _document(episodes, _number(request)))

    async def give_robot(request: Request) -> Response:
        name, arm = request.path_params["name"], request.query_params.get("arm", "0")
        return await run_or_message(
            lambda: Response(
                robot_glb(_arm(episodes, name, arm).urdf), media_type="model/gltf-binary", headers=NOT_KEPT
            )
        )

    return Starlette(
        routes=[
            Route("/", show_list),
            Route("/episode/{number}", show_episode),
            Route(f"/episode/{{number}}/{DOCUMENT}", give_document),
            Route("/robot/{name}/links.glb", give_robot),
            Mount("/", pages),
        ]
    )


def missing_twins_application(why: str) -> ASGIApp:
    """Return a substitute for the twin pages if the twins are not available: scripts, styles, and a message with the reason."""

    async def tell(request: Request) -> Response:
        return message_response(404, why)

    return Starlette(routes=[PACKAGE_FILES, Route("/{path:path}", tell)])


def _arm(episodes: EpisodeFolders, name: str, number: str) -> Robot:
    robot = episodes.robot(name)
    arms = robot.arms or (robot,)
    if number not in map(str, range(len(arms))):
        raise UsageError("the robot has no arm of this number")
    return arms[int(number)]


def _number(request: Request) -> int:
    asked = request.path_params["number"]
    if not (asked.isascii() and asked.isdigit() and len(asked) < 10):
        raise UsageError("there is no episode of this number")
    return int(asked)


def _list(episodes: EpisodeFolders, start: str, outcome: str, title: str) -> Response:
    outcome = outcome if outcome in OUTCOMES and episodes.attempts is not None else ""
    count = len(episodes) if episodes.attempts is None else episodes.attempts.count(outcome)
    place = int(start) if start.isascii() and start.isdigit() and len(start) < 10 else 0
    place = place - place % PAGE_EPISODES if place < count else 0
    rows: list[AttemptRow | str]
    if episodes.attempts is None:
        numbers = range(place, min(place + PAGE_EPISODES, count))
        rows = [_row(said, number) for said, number in zip(episodes.metadata_or_errors(numbers), numbers, strict=True)]
    else:
        rows = list(episodes.attempts.page(place, PAGE_EPISODES, outcome))
    shown = EpisodeList(
        rows, place, count, len(episodes), outcome, episodes.attempts.outcomes if episodes.attempts else {}
    )
    return HTMLResponse(list_page(shown, title, episodes.without_attempts, LINKS), headers=NOT_KEPT)


def _row(said: dict[str, Any] | str, number: int) -> AttemptRow | str:
    try:
        return said if isinstance(said, str) else recorded_row(said, number)
    except EpisodesError as error:  # a broken episode affects only its own line
        return str(error)


def _episode(episodes: EpisodeFolders, number: int) -> Response:
    said = episodes.said(number)
    count = len(episodes)
    before, after = number - 1 if number else None, number + 1 if number + 1 < count else None
    return HTMLResponse(episode_page(said, number, count, LINKS, before, after), headers=NOT_KEPT)


def _document(episodes: EpisodeFolders, number: int) -> Response:
    document = episode_document(episodes.episode(number), number, episodes, LINKS)
    return Response(document_bytes(document), media_type="application/json", headers=NOT_KEPT)
