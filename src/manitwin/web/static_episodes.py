"""Static pages of recorded episodes: the list, a 3D view of each, the robot's links and the pages of the twins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from manitwin.errors import UsageError
from manitwin.web.episode_document import DOCUMENT, episode_document
from manitwin.web.episode_folders import EpisodeFolders
from manitwin.web.episode_pages import PAGE_EPISODES, EpisodeList, episode_page, list_page, recorded_row
from manitwin.web.html import EPISODE_TIMELINE, EPISODE_VIEWER
from manitwin.web.links import FileLinks, list_name
from manitwin.web.robot_model import robot_glb
from manitwin.web.static_scripts import NAMES, UP, binary_script, document_script, write
from manitwin.web.static_twins import WrittenPages
from manitwin.web.twin_document import document_bytes
from manitwin.web.twin_page import SCRIPTS

DATA_SCRIPT = "episode_view.js"


def write_episodes(
    out: Path, episodes: EpisodeFolders, numbers: Sequence[int], title: str, on_page: Callable[[str], None]
) -> WrittenPages:
    """Write the pages of some episodes to a folder; episodes with missing twins or robot are left out."""
    done, links, count = WrittenPages((*SCRIPTS, EPISODE_TIMELINE, EPISODE_VIEWER)), FileLinks(UP), len(episodes)
    writer = _Writer(out, episodes, done)
    found: dict[int, tuple[dict[str, Any], list[str]]] = {}
    for number in numbers:
        whole = done.run_or_record(f"episode {number}", partial(writer.write_data, number))
        if whole is not None:
            found[number] = whole
        on_page(f"episode {number}")
    kept = list(found)
    rows = [recorded_row(said, number) for number, (said, _) in found.items()]
    for place, (number, (said, scripts)) in enumerate(found.items()):
        before, after = (kept[place - 1] if place else None), (kept[place + 1] if place + 1 < len(kept) else None)
        page = episode_page(said, number, count, links, before, after, data=[DATA_SCRIPT, *scripts])
        done.size_bytes += write(out / "episodes" / str(number) / "index.html", page.encode())
    done.pages = len(rows)
    for start in range(0, len(rows), PAGE_EPISODES) or [0]:
        shown = EpisodeList(rows[start : start + PAGE_EPISODES], start, len(rows), len(rows), "", {})
        done.size_bytes += write(out / list_name(start), list_page(shown, title, "", FileLinks()).encode())
    return done


class _Writer:
    def __init__(self, out: Path, episodes: EpisodeFolders, done: WrittenPages):
        self._out, self._episodes, self._done = out, episodes, done
        self._robots: set[str] = set()

    def write_data(self, number: int) -> tuple[dict[str, Any], list[str]]:
        """Write the data of an episode's page; return its data except arrays, and the relative URLs of the page's scripts.

        Raises ManiTwinError if it cannot be shown completely.
        """
        episodes = self._episodes
        if episodes.twins is None:
            raise UsageError(episodes.without_twins)
        said, episode = episodes.said(number), episodes.episode(number)
        recorded_row(said, number)
        models = self._done.write_twins(self._out, episodes.twins, (each.twin_id for each in episode.objects))
        document = episode_document(episode, number, episodes, FileLinks(UP))
        if document["unreadable"]:
            raise UsageError(document["unreadable"][0])
        robots = self._write_robots(episode.robot.name)
        script = document_script(NAMES.episode(number, DOCUMENT), document_bytes(document))
        self._done.size_bytes += write(self._out / "episodes" / str(number) / DATA_SCRIPT, script)
        return said, [*models, *robots]

    def _write_robots(self, name: str) -> list[str]:
        """Write the missing link meshes of the arms; return the relative URLs of their scripts."""
        robot = self._episodes.robot(name)
        scripts = []
        for number, arm in enumerate(robot.arms or (robot,)):
            file = NAMES.robot(robot.name, number)
            if file not in self._robots:
                content = binary_script(file, robot_glb(arm.urdf))
                self._done.size_bytes += write(self._out / f"{file}.js", content)
                self._robots.add(file)
            scripts.append(f"{UP}{file}.js")
        return scripts
