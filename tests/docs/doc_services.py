"""The services that pages name, each by the fake of it: at the vendor's own address, as far as a client can tell."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import urlsplit

from manitwin.models.fakes.catalog import REHEARSALS, serving
from manitwin.models.fakes.server import FakeServer, FakeService, Request, Response

KEY = "rehearsal-key"
REDIRECTED = Path(__file__).parent / "redirected"

ADDRESSES = {
    "https://api.openai.com/v1": ("openai", "/v1"),
    "https://generativelanguage.googleapis.com/v1beta/openai": ("openai", "/v1"),
    "http://localhost:8000": ("openai", ""),
    "http://localhost:11434": ("openai", ""),
    "https://api.anthropic.com": ("anthropic", ""),
    "https://api.hyper3d.com": ("rodin", ""),
    "https://api.tripo3d.ai": ("tripo", ""),
    "https://api.meshy.ai": ("meshy", ""),
    "https://queue.fal.run": ("fal", ""),
    "http://gpu-box:8081": ("hunyuan3d", ""),
}
"""What a page's commands reach over HTTP, and which fake answers there, below which path."""


@dataclass(frozen=True)
class WithoutKey:
    """A service on one's own machine: it asks for no key."""

    service: FakeService

    def answer(self, request: Request, base_url: str) -> Response:
        keyed = replace(request, headers=request.headers | {"authorization": f"Bearer {KEY}"})
        return self.service.answer(keyed, base_url)


@contextmanager
def services() -> Iterator[dict[str, str]]:
    """Serve all of them; yields the environment that leads there, and ``GRASPGEN`` and ``GRASPGENX``, their addresses."""
    redirected = {}
    with ExitStack() as stack:
        for documented, (name, path) in ADDRESSES.items():
            service = REHEARSALS[name].factory()
            local = urlsplit(documented).hostname == "localhost"
            server = stack.enter_context(FakeServer(WithoutKey(service) if local else service))
            redirected[documented] = server.url + path
            server.url = documented  # its links lead to the address that its client knows, and would refuse another
        graspers = {name.upper(): stack.enter_context(serving(name)).url for name in ("graspgen", "graspgenx")}
        yield {"DOCS_REDIRECTED": json.dumps(redirected), **graspers}
