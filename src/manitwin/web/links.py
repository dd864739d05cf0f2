"""The addresses on a page: of a server, or relative ones of plain files. A page is the same in both but for these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol
from urllib.parse import quote, urlencode

THUMBNAIL = "views/rgb_00.webp"


class Links(Protocol):
    """Addresses as one page needs them."""

    @property
    def live(self) -> bool:
        """Tell whether a server answers, which can search and read files when they are asked for."""
        ...

    def gallery(self, query: str = "") -> str:
        """Return the gallery, with the fields of a view."""
        ...

    def twin(self, twin_id: str) -> str:
        """Return a twin's page."""
        ...

    def file(self, twin_id: str, name: str, revision: str) -> str:
        """Return a file of a twin; the revision keeps an older one in a cache from being shown."""
        ...

    def scenes(self, start: int = 0) -> str:
        """Return the list of scenes, from one on."""
        ...

    def scene(self, scene_id: str, name: str = "") -> str:
        """Return a scene's page, or a file of it."""
        ...

    def episodes(self, start: int = 0, outcome: str = "") -> str:
        """Return the list of episodes, from one on, of one outcome or of all."""
        ...

    def episode(self, number: int, name: str = "") -> str:
        """Return the page of a recorded episode, or a file of it."""
        ...

    def robot(self, name: str, arm: int = 0) -> str:
        """Return the looks of the links of a robot, of two arms those of one."""
        ...

    def asset(self, name: str) -> str:
        """Return a style or script of this package."""
        ...


@dataclass(frozen=True)
class ServerLinks:
    """The addresses of the server."""

    live = True

    def gallery(self, query: str = "") -> str:
        """Return the gallery, with the fields of a view."""
        return f"/?{query}" if query else "/"

    def twin(self, twin_id: str) -> str:
        """Return a twin's page."""
        return f"/twin/{quote(twin_id, safe='')}"

    def scenes(self, start: int = 0) -> str:
        """Return the list of scenes, from one on."""
        return f"/?from={start}" if start else "/"

    def scene(self, scene_id: str, name: str = "") -> str:
        """Return a scene's page, or a file of it."""
        return f"/scene/{quote(scene_id, safe='')}{name and f'/{name}'}"

    def episodes(self, start: int = 0, outcome: str = "") -> str:
        """Return the list of episodes, from one on, of one outcome or of all."""
        asked = {**({"outcome": outcome} if outcome else {}), **({"from": start} if start else {})}
        return f"/?{urlencode(asked)}" if asked else "/"

    def episode(self, number: int, name: str = "") -> str:
        """Return the page of a recorded episode, or a file of it."""
        return f"/episode/{number}{name and f'/{name}'}"

    def robot(self, name: str, arm: int = 0) -> str:
        """Return the looks of the links of a robot, of two arms those of one."""
        return f"/robot/{quote(name, safe='')}/links.glb{f'?arm={arm}' if arm else ''}"

    def file(self, twin_id: str, name: str, revision: str) -> str:
        """Return a file of a twin."""
        return f"{self.twin(twin_id)}/{quote(name)}?r={quote(revision[:16], safe='')}"

    def asset(self, name: str) -> str:
        """Return a style or script of this package."""
        return f"/static/{name}"


@dataclass(frozen=True)
class FileLinks:
    """Relative addresses of plain files; ``up`` leads from the page to the folder of the gallery."""

    up: str = ""
    live = False

    def gallery(self, query: str = "") -> str:
        """Return the gallery: all cards are on one page."""
        return f"{self.up}index.html"

    def twin(self, twin_id: str) -> str:
        """Return a twin's page."""
        return f"{self.up}twins/{quote(twin_id, safe='')}/index.html"

    def file(self, twin_id: str, name: str, revision: str) -> str:
        """Return a file of a twin."""
        return f"{self.up}twins/{quote(twin_id, safe='')}/{quote(name)}"

    def scenes(self, start: int = 0) -> str:
        """Return the list of scenes, from one on."""
        return f"{self.up}{list_name(start)}"

    def scene(self, scene_id: str, name: str = "") -> str:
        """Return a scene's page, or a file of it."""
        return f"{self.up}scenes/{quote(scene_id, safe='')}/{name or 'index.html'}"

    def episodes(self, start: int = 0, outcome: str = "") -> str:
        """Return the list of episodes, from one on; there is none of one outcome."""
        return f"{self.up}{list_name(start)}"

    def episode(self, number: int, name: str = "") -> str:
        """Return the page of a recorded episode, or a file of it."""
        return f"{self.up}episodes/{number}/{name or 'index.html'}"

    def robot(self, name: str, arm: int = 0) -> str:
        """Return the looks of the links of a robot, of two arms those of one."""
        return f"{self.up}robots/{quote(name, safe='')}/links_{arm}.glb"

    def asset(self, name: str) -> str:
        """Return a style or script of this package."""
        return f"{self.up}static/{name}"


def list_name(start: int) -> str:
    """Return the file of a list from one entry on."""
    return f"index_{start}.html" if start else "index.html"
