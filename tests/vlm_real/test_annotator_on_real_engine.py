"""The annotator's four questions put to a real engine by a model that understands nothing.

What it answers follows the schemas and is nonsense: it may pass as what it says, or end as an error; it may not become anything
that was not said.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from picture_questions import SETTINGS, Overheard, Protocol, chat_at
from PIL import Image
from tiny_engine import MODEL, TinyEngine

from handmade import mug, visual
from manitwin import build
from manitwin.config import BuildConfig
from manitwin.errors import BadReply, Rejected
from manitwin.formats.glb import write_glb
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.annotators.protocol import PointsRequest, Subject
from manitwin.models.annotators.vlm.annotator import VlmAnnotator
from manitwin.models.vlm.protocol import Picture, Turn
from manitwin.pipeline.candidates import choose_candidates
from manitwin.render.cameras import orbit_cameras
from manitwin.render.raycast import merge_parts
from manitwin.render.renderer import shared_renderer

pytestmark = [pytest.mark.slow, pytest.mark.vlm_real]

CONFIG = BuildConfig(vlm=SETTINGS)
REPAIR, DOUBT = "Your answer cannot be used", "Please check your answer again"


@pytest.fixture(scope="module")
def request_(tmp_path_factory: pytest.TempPathFactory) -> PointsRequest:
    """A red mug, drawn from eight sides, and 42 candidates on it."""
    folder, solid = tmp_path_factory.mktemp("mug"), mug()
    parts = (visual(solid, baseColorFactor=[200, 40, 30, 255]),)
    cameras = orbit_cameras(solid.vertices, fov_y_deg=30.0, size_px=CONFIG.vlm.picture_px)
    views = []
    for index, frame in enumerate(shared_renderer().render(parts, cameras)):
        views.append(folder / f"rgb_{index:02d}.webp")
        Image.fromarray(frame.rgb).save(views[-1])
    caster, rng = RayCaster(merge_parts(list(parts))), np.random.default_rng(0)
    positions, normals, visible = choose_candidates(solid, caster, cameras, samples=20_000, count=42, rng=rng)
    return PointsRequest(
        subject=Subject("mug", solid, parts, False, tuple(views), tuple(cameras), seed=0),
        positions_m=positions,
        normals=normals,
        marked_views=(),
        visible=tuple(tuple(int(i) for i in seen) for seen in visible),
        center_of_mass_m=solid.center_mass,
        max_opening_m=0.08,
    )


def follows(value: Any, schema: dict[str, Any]) -> bool:
    """Tell whether a JSON value has the form of a schema: types, enums, required and no other properties."""
    if "anyOf" in schema:
        return any(follows(value, choice) for choice in schema["anyOf"])
    if "enum" in schema:
        return value in schema["enum"]
    match schema["type"]:
        case "object":
            parts = schema["properties"]
            return list(value) == list(parts) and all(follows(value[name], parts[name]) for name in parts)
        case "array":
            return isinstance(value, list) and all(follows(item, schema["items"]) for item in value)
        case "number":
            return isinstance(value, int | float) and not isinstance(value, bool)
        case kind:
            return type(value) is {"string": str, "boolean": bool, "integer": int}[kind]


@pytest.mark.parametrize("protocol", ["openai", "anthropic"])
def test_engine_holds_the_schema_of_every_question_of_a_build(
    engine: TinyEngine, figures: list[str], request_: PointsRequest, protocol: Protocol
) -> None:
    chat = chat_at(engine.url, protocol)
    questions = VlmAnnotator(chat, CONFIG).questions(request_, "ceramic", request_.subject.solid.extents)
    assert [q.name for q in questions] == [
        "quality",
        "physical",
        "captions",
        "functional_points",
        *["grasp_points"] * 3,
    ]
    for question in questions:
        began = time.monotonic()
        reply = chat.ask(question)
        assert follows(json.loads(reply.text, strict=False), question.schema)
        pictures = sum(isinstance(part, Picture) for part in question.parts)
        figures.append(
            f"{protocol}, {question.name}, {pictures} pictures: {time.monotonic() - began:.1f} s,"
            f" {reply.usage.input_tokens} tokens read, {reply.usage.output_tokens} written"
        )


def quality_as_said(annotator: VlmAnnotator, request: PointsRequest, heard: Overheard) -> bool:
    verdict, answer = annotator.judge_quality(request.subject), heard.last("quality")
    return verdict.single_object == (answer["single_object"] == "yes") and (
        not verdict.visual_quality or answer["visual_quality"] == "yes"
    )


def physical_as_said(annotator: VlmAnnotator, request: PointsRequest, heard: Overheard) -> bool:
    estimates, answer = annotator.estimate_physical(request.subject), heard.last("physical")
    assert estimates.mass_kg is not None
    longest = max(answer[f"{side}_m"]["typical"] for side in ("length", "width", "height"))
    return (estimates.mass_kg.value, estimates.longest_axis_m.value) == (answer["mass_kg"]["typical"], longest)


def words_as_said(annotator: VlmAnnotator, request: PointsRequest, heard: Overheard) -> bool:
    language = annotator.describe(request.subject, "ceramic", request.subject.solid.extents)
    answer = heard.last("captions")
    said = {text.strip() for text in answer.values()}
    return language.category.startswith(answer["category"].strip()) and set(language.captions) <= said


def points_as_said(annotator: VlmAnnotator, request: PointsRequest, heard: Overheard) -> bool:
    selected, answer = annotator.select_points(request), heard.last("functional_points")
    return [point.label for point in selected.functional] == [point["label"] for point in answer["points"]]


def complaints(turns: tuple[Turn, ...]) -> list[str]:
    """Return the openings of what was said against the answers so far."""
    return [opening for turn in turns for opening in (REPAIR, DOUBT) if turn.text.startswith(opening)]


@pytest.mark.parametrize("name", ["mug", "claw hammer", None])
@pytest.mark.parametrize("protocol", ["openai", "anthropic"])
@pytest.mark.parametrize("as_said", [quality_as_said, physical_as_said, words_as_said, points_as_said])
def test_nonsense_ends_as_what_was_said_or_as_an_error_after_one_repair(
    engine: TinyEngine,
    figures: list[str],
    request_: PointsRequest,
    as_said: Callable[[VlmAnnotator, PointsRequest, Overheard], bool],
    protocol: Protocol,
    name: str | None,
) -> None:
    request = replace(request_, subject=replace(request_.subject, name=name))
    heard = Overheard(chat_at(engine.url, protocol))
    before = engine.requests()
    try:
        assert as_said(VlmAnnotator(heard, CONFIG), request, heard)
        outcome = "answered as said"
    except BadReply as error:
        outcome = f"BadReply: {error}"
        again = complaints(heard.asked[-1][1])
        if "no usable answer" in str(error):
            assert again.count(REPAIR) == 1
        else:
            assert "cut at" in str(error) or again.count(DOUBT) == 1
    except Rejected as error:
        outcome = f"rejected: {error}"
        assert complaints(heard.asked[-1][1])[-1] == DOUBT
    figures.append(f"{protocol}, {as_said.__name__.split('_')[0]}, name {name}: {outcome[:200]}")
    assert engine.requests() - before == len(heard.asked)
    for _, turns in heard.asked:
        assert len(set(complaints(turns))) == len(complaints(turns)) == len(turns) / 2


def test_build_by_nonsense_ends_without_a_twin_and_says_why(
    engine: TinyEngine, figures: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "mug.glb").write_bytes(write_glb([visual(mug(), baseColorFactor=[200, 40, 30, 255])]))
    before, began = engine.requests(), time.monotonic()
    spec = f"openai:{MODEL}@{engine.url}/v1"
    report = build(tmp_path / "mug.glb", tmp_path / "out", name="mug", units="m", vlm=spec, jobs=1, config=CONFIG)
    (result,) = report.results
    assert result.status in ("rejected", "unfinished")
    assert engine.requests() > before
    figures.append(f"a build: {result.status} after {time.monotonic() - began:.0f} s, {result.detail[:160]!r}")
