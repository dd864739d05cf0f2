"""Answers of models and services, changed on their way: chat models, generators, grasp servers, and what is kept of answers.

A case's file is the seed of the changes; the empty one changes nothing.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import trimesh
from fuzz_mutations import mutate_bytes, mutate_json, mutated
from fuzz_target import Case, target

import generator_runs
from handmade import mug
from manitwin.config import BuildConfig, ServicesConfig, VlmConfig
from manitwin.models.fakes.anthropic_messages import FakeAnthropic
from manitwin.models.fakes.fal import FakeFal
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.grasp_servers import FakeGraspGen, FakeGraspGenX
from manitwin.models.fakes.hunyuan3d import FakeHunyuan3d
from manitwin.models.fakes.meshy import FakeMeshy
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.rodin import FakeRodin
from manitwin.models.fakes.server import FakeServer, Request, Response
from manitwin.models.fakes.tripo import FakeTripo
from manitwin.models.fakes.vlm_answers import rehearsal_answer
from manitwin.models.generators.fal import FalGenerator
from manitwin.models.generators.hunyuan3d import Hunyuan3dGenerator
from manitwin.models.generators.meshy import MeshyGenerator
from manitwin.models.generators.rodin import RodinGenerator
from manitwin.models.generators.tripo import TripoGenerator
from manitwin.models.graspers.grasp_server import GraspServer, pack, unpack
from manitwin.models.graspers.graspgen import GraspGenGrasper
from manitwin.models.graspers.graspgenx import GraspGenXGrasper
from manitwin.models.graspers.protocol import GraspRequest
from manitwin.models.vlm.answer_cache import CachedChat
from manitwin.models.vlm.anthropic_messages import AnthropicMessages
from manitwin.models.vlm.openai_chat import OpenAiChat
from manitwin.models.vlm.protocol import Picture, Question, Reply, Turn, Usage, question_digest
from manitwin.models.vlm.replay import Replay
from manitwin.models.vlm.structured import json_object_in
from manitwin.robots.grippers.gripper import load_gripper

KEY = generator_runs.KEY


def seed(folder: Path) -> None:
    (folder / "seed").write_bytes(b"")


def changes(case: Case) -> Random | None:
    """The generator of a case's changes; None where nothing is to be changed."""
    content = case.file.read_bytes()
    return Random(content) if content else None


class Changed:
    """A service some of whose answers are changed on their way."""

    def __init__(self, inner: Any, rng: Random | None):
        self.inner, self.rng = inner, rng

    def answer(self, request: Request, base_url: str) -> Response:
        response: Response = self.inner.answer(request, base_url)
        if self.rng is None or self.rng.random() < 0.5:
            return response
        content, headers = response.content()
        kind = self.rng.randrange(10)
        if kind == 0:
            return replace(
                response, status=self.rng.choice((200, 201, 204, 400, 401, 402, 404, 409, 418, 422, 429, 500, 503))
            )
        if kind == 1:
            name = self.rng.choice(("Retry-After", "Content-Type", "Content-Encoding", "Location"))
            value = self.rng.choice(
                ("", "-1", "nan", "1e9", "Wed, 21 Oct 2099 07:28:00 GMT", "x" * 5000, "gzip", "identity", "text/html")
            )
            return Response(response.status, content, {**headers, name: value})
        if kind == 2:
            return Response(response.status, content, headers, cut_after=self.rng.randrange(len(content) + 1))
        name = "a.json" if content[:1] in b"[{" else "a.glb" if content[:4] == b"glTF" else "a.bin"
        return Response(response.status, mutated(name, content, (), self.rng), headers)


def generated(service: Callable[[], Any], client: Callable[[str, BuildConfig], Any]) -> Callable[[Case], None]:
    """Return what runs a generator against its fake service, whose answers are changed."""

    def read(case: Case) -> None:
        settings = generator_runs.config(attempts=1, retries=1, timeout_s=3)
        with FakeServer(Changed(service(), changes(case))) as server, tempfile.TemporaryDirectory() as folder:
            ran = generator_runs.run(client(server.url, settings), Path(folder), settings)
        if ran.error is not None:
            raise ran.error

    return read


def no_wait(seconds: float) -> None:
    """Wait for nobody."""


GENERATORS: dict[str, tuple[Callable[[], Any], Callable[[str, BuildConfig], Any]]] = {
    "rodin": (
        lambda: FakeRodin(key=KEY),
        lambda url, s: RodinGenerator("Regular", f"{url}/api/v2", KEY, s, sleep=no_wait),
    ),
    "tripo": (
        lambda: FakeTripo(key=KEY),
        lambda url, s: TripoGenerator("v2.5-20250123", f"{url}/v2/openapi", KEY, s, sleep=no_wait),
    ),
    "meshy": (lambda: FakeMeshy(key=KEY), lambda url, s: MeshyGenerator("meshy-6", url, KEY, s, no_wait)),
    "fal": (lambda: FakeFal(key=KEY), lambda url, s: FalGenerator("fal-ai/trellis", url, KEY, s, no_wait)),
    "hunyuan3d": (lambda: FakeHunyuan3d(), lambda url, s: Hunyuan3dGenerator("2.1", url, s, no_wait)),
}
for vendor, (service, client) in GENERATORS.items():
    target(f"service-{vendor}", seed, generated(service, client), links=False, weight=0.1)


def question() -> Question:
    from mug_question import question as asked

    return asked()


def chat(service: Callable[[], Any], client: Callable[[str], Any]) -> Callable[[Case], None]:
    """Return what asks a chat model over HTTP, whose server's answers are changed."""

    def read(case: Case) -> None:
        with FakeServer(Changed(service(), changes(case))) as server:
            json_object_in_reply(client(server.url).ask(question()).text)

    return read


def chats() -> None:
    from mug_question import KEY, answer_mug, services

    quick = services(retries=1, timeout_s=3)
    openai = lambda url: OpenAiChat("tiny-vl", f"{url}/v1", KEY, VlmConfig(), quick, no_wait)  # noqa: E731
    anthropic = lambda url: AnthropicMessages("claude-x", url, KEY, VlmConfig(), quick, no_wait)  # noqa: E731
    target(
        "service-openai", seed, chat(lambda: FakeOpenAi(Faults({}), KEY, answer_mug), openai), links=False, weight=0.1
    )
    target(
        "service-anthropic",
        seed,
        chat(lambda: FakeAnthropic(Faults({}), KEY, answer_mug), anthropic),
        links=False,
        weight=0.1,
    )


def json_object_in_reply(text: str) -> None:
    try:
        json_object_in(text)
    except ValueError as error:  # what `ask` asks again for
        assert len(str(error)) < 10_000


chats()


def answers(folder: Path) -> None:
    (folder / "answer.json").write_text(json.dumps({"reason": "so", "material": "glass", "mass_kg": 0.4}))
    (folder / "fenced.md").write_text('<think>hm</think>So:\n```json\n{"a": [1, {"b": "c"}]}\n```\nor {"a": 2}')
    (folder / "words.txt").write_text('I think {"a": 1} and then {"b": {"c": [1, 2]}}')


target(
    "answers",
    answers,
    lambda case: json_object_in_reply(case.file.read_bytes().decode("utf-8", "replace")),
    links=False,
)


class MutatingChat:
    """A chat model that answers as the rehearsal does, with changes."""

    name, model = "mutating", "eyes-1"

    def __init__(self, rng: Random | None):
        self.rng = rng

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        texts = [
            question.instructions,
            *(p for p in question.parts if isinstance(p, str)),
            *(turn.text for turn in turns),
        ]
        pngs = [part.png for part in question.parts if isinstance(part, Picture)]
        text = json.dumps(rehearsal_answer(question.name, question.schema, "\n".join(texts), pngs))
        if self.rng is not None and self.rng.random() < 0.7:
            text = mutate_json(text.encode(), self.rng).decode("utf-8", "replace")
        return Reply(text, Usage(1000, 100), self.model)


@cache
def points_of_mug() -> Any:
    from scripted_chat import points_request

    return points_request(mug(), Path(tempfile.mkdtemp()), "mug", 20)


def annotate(case: Case) -> None:
    """Ask all questions about a mug."""
    from manitwin.models.annotators.vlm.annotator import VlmAnnotator

    request, rng = points_of_mug(), changes(case)
    seen = VlmAnnotator(MutatingChat(rng), BuildConfig())
    asked = [
        lambda: seen.judge_quality(request.subject),
        lambda: seen.estimate_physical(request.subject),
        lambda: seen.describe(request.subject, "plastic", request.subject.solid.extents),
        lambda: seen.select_points(request),
    ]
    (rng or Random(0)).choice(asked)()


target("annotator", seed, annotate, links=False, weight=0.1)


def grasp_messages(folder: Path) -> None:
    message = {
        "grasps": np.eye(4, dtype=np.float32)[None],
        "scores": np.array([0.5], np.float32),
        "n": 1,
        "name": "panda",
    }
    (folder / "message.msgpack").write_bytes(pack(message))


def read_message(case: Case) -> None:
    try:
        unpack(case.file.read_bytes())
    except ValueError as error:  # what the client says of a bad message
        assert "\n" not in str(error)


target("grasp-messages", grasp_messages, read_message, links=False)


class Garbling(GraspServer):
    """A grasp server in this process, whose answers are changed."""

    def __init__(self, fake: Any, rng: Random | None):
        super().__init__("tcp://127.0.0.1:1", "fake", ServicesConfig(retries=0, timeout_s=1), no_wait)
        self.fake, self.rng = fake, rng

    def _exchange(self, question: dict[str, Any]) -> dict[str, Any]:
        reply = pack(self.fake.answer(unpack(pack(question))))
        if self.rng is not None and self.rng.random() < 0.7:
            reply = mutate_bytes(reply, self.rng)
        return self._read(reply)


@cache
def grasp_request() -> GraspRequest:
    bar = trimesh.creation.box([0.04, 0.03, 0.2])
    return GraspRequest(
        solid=bar, hulls=(np.array(bar.vertices),), mass_kg=0.3, center_of_mass_m=np.zeros(3), object_friction=0.5,
        gripper=load_gripper("panda"), focus_points_m=np.empty((0, 3)), max_proposals=20, seed=7,
    )  # fmt: skip


@cache
def fakes() -> tuple[Any, Any]:
    return FakeGraspGen(), FakeGraspGenX()


target(
    "graspgen",
    seed,
    lambda case: GraspGenGrasper(Garbling(fakes()[0], changes(case)), "franka_panda").propose(grasp_request()),
    links=False,
    weight=0.1,
)
target("graspgenx", seed, lambda case: GraspGenXGrasper(Garbling(fakes()[1], changes(case))).propose(grasp_request()),
       links=False, weight=0.1)  # fmt: skip


class Silent:
    """A chat model that answers one thing."""

    name, model, price, decides = "silent", "eyes-1", None, {"model": "eyes-1"}

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        return Reply("{}", Usage(1, 1), self.model)


def kept_answers(folder: Path) -> None:
    CachedChat(Silent(), folder).ask(question())  # type: ignore[arg-type]


def replays(folder: Path) -> None:
    line = {
        "question": "mug", "key": question_digest(question(), ()), "model": "eyes-1", "text": "{}", "answered_by": "eyes-1-x",
        "tokens": [1, 2],
    }  # fmt: skip
    (folder / "record.jsonl").write_text(
        "".join(json.dumps({**line, "key": key}) + "\n" for key in (line["key"], "ab"))
    )


target("answer-cache", kept_answers, lambda case: CachedChat(Silent(), case.folder).ask(question()), files=("*.json",))  # type: ignore[arg-type]
target("replay", replays, lambda case: Replay(case.file).ask(question()))
