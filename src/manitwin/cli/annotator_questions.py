"""The questions about a finished twin, as a vision-language model was or would be asked them."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from manitwin.config import BuildConfig
from manitwin.errors import UsageError
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.annotators.protocol import AnnotatorQuestion, PointsRequest, Subject
from manitwin.models.annotators.vlm.annotator import ANSWER_TOKENS, PROMPTS, VlmAnnotator
from manitwin.models.registry import without_url
from manitwin.models.vlm.openai_dialect import instructions_with_schema
from manitwin.models.vlm.prices import TokenPrice, estimated_usage
from manitwin.models.vlm.protocol import Picture, Question, Reply, Turn
from manitwin.pipeline.views import write_webp
from manitwin.render.cameras import orbit_cameras
from manitwin.render.raycast import merged, seen_tolerance_m, visible_points
from manitwin.render.renderer import shared_renderer
from manitwin.robots.grippers.gripper import Gripper, load_gripper, shipped_grippers
from manitwin.twin.loaded_twin import Twin


class SilentModel:
    """A chat model by name only: it is never asked."""

    name = "silent"

    def __init__(self, model: str, price: TokenPrice | None):
        self.model, self.price = model, price

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Raise UsageError: nothing is sent from here."""
        raise UsageError(f"{self.model} is not asked here; build the twin with it to have its answers")


@dataclass(frozen=True)
class AskedQuestion:
    """One question, the folder that it is written to, the prompt that it comes from, and the system's turn as it is sent.

    OpenAI's protocol says the schema there too, for servers that pass over ``response_format``.
    """

    folder: str
    topic: AnnotatorQuestion
    prompt: str
    question: Question
    system: str


@dataclass(frozen=True)
class AskedQuestions:
    """All questions about one twin, by the annotator that would ask them."""

    twin_id: str
    annotator: VlmAnnotator
    price: TokenPrice | None
    questions: tuple[AskedQuestion, ...]


def questions_about(twin_folder: Path, config: BuildConfig, spec: str) -> AskedQuestions:
    """Return what the model of ``spec`` would be asked about a finished twin, in order; nothing is sent.

    Raises TwinError for a folder that is no twin or a rejected one, RendererMissing where nothing renders.
    """
    twin = Twin(twin_folder)
    name, _, argument = without_url(spec).partition(":")
    model = argument or name
    per_million = config.services.usd_per_million_tokens
    price = None if per_million is None else TokenPrice(*per_million)
    annotator = VlmAnnotator(SilentModel(model, price), config)
    with tempfile.TemporaryDirectory() as folder:
        request = _request(twin, config, Path(folder))
        physical = twin.physical
        asked = annotator.questions(request, physical.material, np.array(physical.extents_m))
    topics: dict[str, AnnotatorQuestion] = {prompt: topic for topic, names in PROMPTS.items() for prompt in names}
    questions = tuple(
        AskedQuestion(
            folder=f"{number}_{q.name}{f'_{q.vote + 1}' if q.name == 'grasp_points' else ''}",
            topic=topics[q.name],
            prompt=q.name,
            question=q,
            system=q.instructions if name == "anthropic" else instructions_with_schema(q),
        )
        for number, q in enumerate(asked, 1)
    )
    return AskedQuestions(twin.record.twin_id, annotator, price, questions)


def _request(twin: Twin, config: BuildConfig, folder: Path) -> PointsRequest:
    """Return what the stages ask with, from what a finished twin still has; views are drawn anew into ``folder``."""
    physical, record = twin.physical, twin.record
    assert record.points is not None and record.grasps is not None
    parts = twin.visual
    points = np.concatenate([part.vertices for part in parts])
    size_px = config.views.size_px or config.vlm.picture_px
    cameras = orbit_cameras(points, fov_y_deg=config.views.fov_y_deg, size_px=size_px)
    views = []
    for index, frame in enumerate(shared_renderer().render(parts, cameras)):
        views.append(folder / f"rgb_{index:02d}.webp")
        write_webp(frame.rgb, views[-1], config.views.webp_quality)
    surface = merged(parts)
    positions, normals = np.array(record.points.candidates.positions_m), np.array(record.points.candidates.normals)
    caster, tolerance_m = RayCaster(surface), seen_tolerance_m(surface.extents)
    seen = [visible_points(positions, normals, camera, caster, tolerance_m) for camera in cameras]
    subject = Subject(
        name=record.name,
        solid=surface,
        parts=tuple(parts),
        metric=True,
        views=tuple(views),
        cameras=tuple(cameras),
        seed=record.provenance.seed,
    )
    return PointsRequest(
        subject=subject,
        positions_m=positions,
        normals=normals,
        marked_views=(),
        visible=tuple(tuple(int(i) for i in np.flatnonzero(row)) for row in seen),
        center_of_mass_m=np.array(physical.center_of_mass_m),
        max_opening_m=_gripper(record.grasps.gripper, config).opening_m,
    )


def _gripper(name: str, config: BuildConfig) -> Gripper:
    for given in config.grippers:
        gripper = load_gripper(given)
        if gripper.name == name:
            return gripper
    if name not in shipped_grippers():
        raise UsageError(
            f"the twin's gripper {name!r} is not among the shipped ones; give the --config it was built with"
        )
    return load_gripper(name)


def write_questions(asked: AskedQuestions, out: Path) -> None:
    """Write a folder for each question (instructions, text, pictures, schema) and a README with tokens and cost.

    Raises UsageError where ``out`` holds something already.
    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise UsageError(f"{out} is there already and not empty; give a new folder")
    out.mkdir(parents=True, exist_ok=True)
    for one in asked.questions:
        _write_question(one, out / one.folder)
    (out / "README.md").write_text(_readme(asked), encoding="utf-8")


def _write_question(asked: AskedQuestion, folder: Path) -> None:
    question = asked.question
    folder.mkdir()
    (folder / "instructions.txt").write_text(asked.system + "\n", encoding="utf-8")
    lines: list[str] = []
    pictures = 0
    for part in question.parts:
        if isinstance(part, Picture):
            pictures += 1
            name = f"picture_{pictures:02d}.png"
            (folder / name).write_bytes(part.png)
            lines.append(f"[{name}]")
        else:
            lines.append(part)
    (folder / "question.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    schema = json.dumps(question.schema, indent=1, ensure_ascii=False)
    (folder / "schema.json").write_text(schema + "\n", encoding="utf-8")


def _readme(asked: AskedQuestions) -> str:
    annotator, price = asked.annotator, asked.price
    lines = [
        f"# What {annotator.chat.model} is asked about twin {asked.twin_id}",
        "",
        "Each folder is one question: `instructions.txt` (the system's turn), `question.txt` (the user's turn, with pictures"
        " where their names stand), `schema.json` (the form of the answer). What contradicts geometry or priors is asked for"
        " once more with what is wrong, which costs about as much again.",
        "",
        "| question | asked with | pictures | tokens read | tokens written | USD |",
        "|---|---|---|---|---|---|",
    ]
    total, read_all, written_all = 0.0, 0, 0
    for one in asked.questions:
        read = estimated_usage(one.question, "").input_tokens
        written = ANSWER_TOKENS[one.prompt]
        usd = (
            0.0
            if price is None
            else (read * price.read_usd_per_million + written * price.written_usd_per_million) / 1e6
        )
        pictures = sum(isinstance(part, Picture) for part in one.question.parts)
        model = annotator.model_for(one.topic)
        lines.append(f"| {one.folder} | {model} | {pictures} | {read} | {written} | {_usd(usd, price)} |")
        total, read_all, written_all = total + usd, read_all + read, written_all + written
    lines.append(f"| all | | | {read_all} | {written_all} | {_usd(total, price)} |")
    if price is None:
        lines += ["", "USD: set `services.usd_per_million_tokens = [read, written]` in the configuration."]
    lines += ["", "Tokens are estimates: 4 characters, or 28 x 28 pixels, a token; models count in their own ways."]
    return "\n".join(lines) + "\n"


def _usd(usd: float, price: TokenPrice | None) -> str:
    return "?" if price is None else f"{usd:.4f}"
