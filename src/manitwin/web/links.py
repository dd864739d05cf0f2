"""Links of a page: absolute paths of a server, or relative paths of static files. Pages differ only in these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol
from urllib.parse import quote, urlencode

THUMBNAIL = "views/rgb_00.webp"


class Links(Protocol):
    """Links that pages need."""

    @property
    def live(self) -> bool:
        """Whether a server answers requests, such as searches."""
        ...

    def gallery(self, query: str = "") -> str:
        """Return the gallery with the fields of a view."""
        ...

    def twin(self, twin_id: str) -> str:
        """Return a twin's page."""
        ...

    def file(self, twin_id: str, name: str, revision: str) -> str:
        """Return a file of a twin; the revision prevents a stale cached file from being shown."""
        ...

    def scenes(self, start: int = 0) -> str:
        """Return the list of scenes, beginning with the ``start``-th."""
        ...

    def scene(self, scene_id: str, name: str = "") -> str:
        """Return a scene's page, or a file of it."""
        ...

    def episodes(self, start: int = 0, outcome: str = "") -> str:
        """Return the list of episodes, beginning with the ``start``-th, with one outcome or all."""
        ...

    def episode(self, number: int, name: str = "") -> str:
        """Return the page of a recorded episode, or a file of it."""
        ...

    def robot(self, name: str, arm: int = 0) -> str:
        """Return the link meshes of a robot, or of one of two arms."""
        ...

    def asset(self, name: str) -> str:
        """Return a style or script of this package."""
        ...


@dataclass(frozen=True)
class ServerLinks:
    """Links of the server."""

    live = True

    def gallery(self, query: str = "") -> str:
        """Return the gallery with the fields of a view."""
        return f"/?{query}" if query else "/"

    def twin(self, twin_id: str) -> str:
        """Return a twin's page."""
        return f"/twin/{quote(twin_id, safe='')}"

    def scenes(self, start: int = 0) -> str:
        """Return the list of scenes, beginning with the ``start``-th."""
        return f"/?from={start}" if start else "/"

    def scene(self, scene_id: str, name: str = "") -> str:
        """Return a scene's page, or a file of it."""
        return f"/scene/{quote(scene_id, safe='')}{name and f'/{name}'}"

    def episodes(self, start: int = 0, outcome: str = "") -> str:
        """Return the list of episodes, beginning with the ``start``-th, with one outcome or all."""
        asked = {**({"outcome": outcome} if outcome else {}), **({"from": start} if start else {})}
        return f"/?{urlencode(asked)}" if asked else "/"

    def episode(self, number: int, name: str = "") -> str:
        """Return the page of a recorded episode, or a file of it."""
        return f"/episode/{number}{name and f'/{name}'}"

    def robot(self, name: str, arm: int = 0) -> str:
        """Return the link meshes of a robot, or of one of two arms."""
        return f"/robot/{quote(name, safe='')}/links.glb{f'?arm={arm}' if arm else ''}"

    def file(self, twin_id: str, name: str, revision: str) -> str:
        """Return a file of a twin."""
        return f"{self.twin(twin_id)}/{quote(name)}?r={quote(revision[:16], safe='')}"

    def asset(self, name: str) -> str:
        """Return a style or script of this package."""
        return f"/static/{name}"


@dataclass(frozen=True)
class FileLinks:
    """Relative links of static files; ``up`` leads from the page to the folder of the gallery."""

    up: str = ""
    live = False

    def gallery(self, query: str = "") -> str:
        """Return the gallery, which has all cards on one page."""
        return f"{self.up}index.html"

    def twin(self, twin_id: str) -> str:
        """Return a twin's page."""
        return f"{self.up}twins/{quote(twin_id, safe='')}/index.html"

    def file(self, twin_id: str, name: str, revision: str) -> str:
        """Return a file of a twin."""
        return f"{self.up}twins/{quote(twin_id, safe='')}/{quote(name)}"

    def scenes(self, start: int = 0) -> str:
        """Return the list of scenes, beginning with the ``start``-th."""
        return f"{self.up}{list_name(start)}"

    def scene(self, scene_id: str, name: str = "") -> str:
        """Return a scene's page, or a file of it."""
        return f"{self.up}scenes/{quote(scene_id, safe='')}/{name or 'index.html'}"

    def episodes(self, start: int = 0, outcome: str = "") -> str:
        """Return the list of episodes, beginning with the ``start``-th; static files have no lists by outcome."""
        return f"{self.up}{list_name(start)}"

    def episode(self, number: int, name: str = "") -> str:
        """Return the page of a recorded episode, or a file of it."""
        return f"{self.up}episodes/{number}/{name or 'index.html'}"

    def robot(self, name: str, arm: int = 0) -> str:
        """Return the link meshes of a robot, or of one of two arms."""
        return f"{self.up}robots/{quote(name, safe='')}/links_{arm}.glb"

    def asset(self, name: str) -> str:
        """Return a style or script of this package."""
        return f"{self.up}static/{name}"


def list_name(start: int) -> str:
    """Return the file name of the list page that begins with the ``start``-th entry."""
    return f"index_{start}.html" if start else "index.html"
