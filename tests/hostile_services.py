"""Every served backend and how it is used to its end, for tests in which its server lies."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from socketserver import StreamRequestHandler
from typing import Any

import numpy as np
from PIL import Image
from pydantic import BaseModel, Field

from generator_runs import photo_request, text_request
from manitwin.config import BuildConfig, VlmConfig
from manitwin.errors import ManiTwinError, Rejected
from manitwin.formats.image_file import png_of
from manitwin.models.fakes.anthropic_messages import FakeAnthropic
from manitwin.models.fakes.fal import FakeFal
from manitwin.models.fakes.hunyuan3d import FakeHunyuan3d
from manitwin.models.fakes.meshy import FakeMeshy
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.rodin import FakeRodin
from manitwin.models.fakes.server import FakeServer, Request, Response
from manitwin.models.fakes.tripo import FakeTripo
from manitwin.models.fakes.vendor import FILES
from manitwin.models.generators.fal import FalGenerator
from manitwin.models.generators.hunyuan3d import Hunyuan3dGenerator
from manitwin.models.generators.meshy import MeshyGenerator
from manitwin.models.generators.protocol import GenerationRequest
from manitwin.models.generators.rodin import RodinGenerator
from manitwin.models.generators.tripo import TripoGenerator
from manitwin.models.vlm.anthropic_messages import AnthropicMessages
from manitwin.models.vlm.openai_chat import OpenAiChat
from manitwin.models.vlm.protocol import Picture, Question
from manitwin.models.vlm.strict_schema import strict_schema
from manitwin.models.vlm.structured import ask
from raw_server import tcp_server

SECRET = "sk-0123456789-that-nobody-may-see"
ASKED_AT_MOST = 12


class Disc(BaseModel):
    """What the chat models are asked for."""

    color: str
    mass_kg: float = Field(gt=0, le=5)


QUESTION = Question(
    "disc",
    "You judge objects.",
    (Picture(png_of(np.asarray(Image.new("RGB", (28, 28), "red")))), "What is it?"),
    strict_schema(Disc),
)


def settings(**services: Any) -> BuildConfig:
    """Settings with a price, one try and little patience."""
    given = {"usd_per_job": 0.5, "usd_per_million_tokens": (1, 2), "retries": 0, "timeout_s": 20.0, **services}
    return BuildConfig.model_validate({"services": given, "generate": {"max_wait_s": 20.0}})


@dataclass(frozen=True)
class Service:
    """A backend behind HTTP: the fake that keeps its contract, and a use of the backend that asks all that it can."""

    fake: Callable[[], Any]
    use: Callable[[str, BuildConfig, Path, str | None], object]


def _chat(kind: Any, path: str) -> Callable[[str, BuildConfig, Path, str | None], object]:
    def use(url: str, config: BuildConfig, folder: Path, key: str | None) -> object:
        chat = kind("tiny", url + path, key, VlmConfig(), config.services, lambda seconds: None)
        return ask(chat, QUESTION, Disc)

    return use


def _generator(
    make: Callable[[str, BuildConfig, str | None], Any], request: Callable[[], GenerationRequest]
) -> Callable[[str, BuildConfig, Path, str | None], object]:
    def use(url: str, config: BuildConfig, folder: Path, key: str | None) -> object:
        generator = make(url, config, key)
        said = generator.probe()
        job = generator.submit(request())
        for _ in range(ASKED_AT_MOST):
            state = generator.poll(job)
            if state.state == "done":
                # as another process that takes the job over
                return said, generator.fetch(job, folder)
            if state.state == "failed":
                raise Rejected("generator_failed", state.message, "generate")
        return said

    return use


def _asleep(seconds: float) -> None:
    """Do not wait."""


def _disc(name: str, schema: dict[str, Any], text: str, pngs: list[bytes]) -> dict[str, Any]:
    return {"color": "red", "mass_kg": 0.4}


def _hunyuan(version: str, **options: Any) -> Callable[[str, BuildConfig, str | None], Any]:
    def make(url: str, config: BuildConfig, key: str | None) -> Any:
        config = config.model_copy(update={"generate": config.generate.model_copy(update={"options": options})})
        return Hunyuan3dGenerator(version, url, config, _asleep)

    return make


SERVICES = {
    "openai": Service(lambda: FakeOpenAi(None, SECRET, _disc), _chat(OpenAiChat, "/v1")),
    "anthropic": Service(lambda: FakeAnthropic(None, SECRET, _disc), _chat(AnthropicMessages, "")),
    "rodin": Service(
        lambda: FakeRodin(key=SECRET),
        _generator(lambda url, c, key: RodinGenerator("Regular", url + "/api/v2", key, c, _asleep), photo_request),
    ),
    "tripo": Service(
        lambda: FakeTripo(key=SECRET),
        _generator(
            lambda url, c, key: TripoGenerator("v2.5-20250123", url + "/v2/openapi", key, c, _asleep), photo_request
        ),
    ),
    "meshy": Service(
        lambda: FakeMeshy(key=SECRET),
        _generator(lambda url, c, key: MeshyGenerator("meshy-6", url, key, c, _asleep), text_request),
    ),
    "fal": Service(
        lambda: FakeFal(key=SECRET),
        _generator(lambda url, c, key: FalGenerator("fal-ai/trellis", url, key, c, _asleep), photo_request),
    ),
    "hunyuan3d-2.0": Service(
        lambda: FakeHunyuan3d(version="2.0"), _generator(_hunyuan("2.0", texture=False), photo_request)
    ),
    "hunyuan3d-2.1": Service(
        lambda: FakeHunyuan3d(version="2.1"), _generator(_hunyuan("2.1", texture=True), photo_request)
    ),
}
KEYLESS = ("hunyuan3d-2.0", "hunyuan3d-2.1")
LINKED = ("rodin", "tripo", "meshy", "fal")
"""Those whose meshes are files behind links."""


class Twisted:
    """A fake of which some answers are changed: ``change`` is given the request's place among those alike, and the answer."""

    def __init__(self, fake: Any, change: Callable[[str, Response], Response]):
        self._fake, self._change, self.seen = fake, change, dict[str, Response]()

    def answer(self, request: Request, base_url: str) -> Response:
        """Answer as the fake does, but for what is changed."""
        answer = self._fake.answer(request, base_url)
        place = place_of(request)
        self.seen[place] = answer
        return self._change(place, answer)


def place_of(request: Request) -> str:
    """Return what is asked for: the method and the last word of the path that is no id."""
    if request.path.startswith(FILES):
        return "FILE"
    words = [word for word in request.path.split("/") if word and not any(letter.isdigit() for letter in word[2:])]
    return f"{request.method} {words[-1] if words else '/'}"


def used(name: str, url: str, folder: Path, config: BuildConfig | None = None) -> ManiTwinError | None:
    """Use a service to its end; return the error that it ends with. Any other exception is a defect."""
    key = None if name in KEYLESS else SECRET
    try:
        said = SERVICES[name].use(url, config or settings(), folder, key)
    except ManiTwinError as error:
        check_told(error, key)
        return error
    assert key is None or key not in repr(said)
    return None


def check_told(error: BaseException, key: str | None) -> None:
    """Assert that an error is one line of bounded length, without the key, that a terminal may show."""
    text: str = str(error)
    assert 0 < len(text) <= 1200 and text.isprintable(), ascii(text)[:2000]
    told: BaseException | None = error
    while told is not None:
        assert key is None or key not in f"{told!r} {told} {vars(told)}", "the key is told"
        told = told.__cause__ or told.__context__


@contextmanager
def twisted(name: str, change: Callable[[str, Response], Response]) -> Iterator[tuple[Twisted, FakeServer]]:
    """Serve a fake some of whose answers are changed."""
    service = Twisted(SERVICES[name].fake(), change)
    with FakeServer(service) as server:
        yield service, server


Script = Callable[[Callable[[bytes], None]], None]


@contextmanager
def raw_server(script: Script) -> Iterator[tuple[str, list[bytes]]]:
    """Answer every request with the bytes that ``script`` writes; gives the URL and the heads of what was asked."""
    asked: list[bytes] = []

    def converse(connection: StreamRequestHandler) -> None:
        head = b""
        while (line := connection.rfile.readline()) not in (b"\r\n", b""):
            head += line
        length = [int(line.split(b":")[1]) for line in head.split(b"\r\n") if line.lower().startswith(b"content-l")]
        asked.append(head + connection.rfile.read(sum(length)))
        script(connection.connection.sendall)

    with tcp_server(converse) as address:
        yield f"http://{address}", asked


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Return the places of a JSON value: of every object and list, and of every leaf."""
    yield path
    if isinstance(value, dict):
        for key in value:
            yield from leaves(value[key], (*path, key))
    elif isinstance(value, list):
        for index in range(min(len(value), 2)):
            yield from leaves(value[index], (*path, index))


def replaced(value: Any, path: tuple[Any, ...], by: Any) -> Any:
    """Return a copy of a JSON value with another part at a place."""
    if not path:
        return by
    copy = json.loads(json.dumps(value))
    inner = copy
    for step in path[:-1]:
        inner = inner[step]
    inner[path[-1]] = by
    return copy
