"""The questions about a finished twin, as a vision-language model was or would be asked them.

What the twin's folder holds is read in a process where limits of time and memory hold: anybody may have made it.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from manitwin.cli.template_questions import template_questions
from manitwin.config import BuildConfig
from manitwin.errors import TwinError, UsageError
from manitwin.formats.isolated import Limits, ProcessCrashed, run_isolated
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.annotators.protocol import PointsRequest, Subject
from manitwin.models.annotators.vlm.annotator import ANSWER_TOKENS, PROMPTS, VlmAnnotator
from manitwin.models.annotators.vlm.template_reader import ANSWER_TOKENS as TEMPLATE_ANSWER_TOKENS
from manitwin.models.registry import without_url
from manitwin.models.vlm.openai_dialect import instructions_with_schema
from manitwin.models.vlm.prices import TokenPrice, estimated_usage
from manitwin.models.vlm.protocol import Picture, Question, Reply, Turn
from manitwin.pipeline.photo import PhotoStage
from manitwin.pipeline.views import draw_views, write_webp
from manitwin.render.raycast import merge_parts, visibility_tolerance_m, visible_points
from manitwin.robots.grippers.gripper import Gripper, load_gripper, shipped_grippers
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.point_records import FunctionalPoint

LIMITS = Limits(seconds=1200.0, memory_bytes=8 << 30)
"""Of reading a twin and drawing its pictures: 5 s and 1 GB for a photo twin on an idle machine, and far longer on a busy one,
where the clock of the wall runs on; the renderer maps 4 GiB of address space.
"""


class UnusedChatModel:
    """A chat model by name only: it is never asked."""

    name = "silent"

    def __init__(self, model: str, price: TokenPrice | None):
        self.model, self.price = model, price

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Raise UsageError: nothing is sent from here."""
        raise UsageError(f"{self.model} cannot be asked by this command; build the twin with it to get its answers")


@dataclass(frozen=True)
class AskedQuestion:
    """One question, the folder that it is written to, what decides its answer, and the system's turn as it is sent.

    OpenAI's protocol says the schema there too, for servers that pass over ``response_format``.
    """

    folder: str
    model: str
    answer_tokens: int
    question: Question
    system: str


@dataclass(frozen=True)
class AskedQuestions:
    """All questions about one twin, by the model that would be asked; ``remark`` is what the reader has to know of them."""

    twin_id: str
    model: str
    price: TokenPrice | None
    questions: tuple[AskedQuestion, ...]
    remark: str = ""


def list_annotator_questions(twin_folder: Path, config: BuildConfig, spec: str) -> AskedQuestions:
    """Return what the model of ``spec`` would be asked about a finished twin, in order; nothing is sent.

    The last three are those that a photo or a text is asked about before there is a mesh. Raises TwinError for a folder that is
    no twin, a rejected one, or one that takes too long or too much memory, RendererMissing where nothing renders.
    """
    name, _, argument = without_url(spec).partition(":")
    model = argument or name
    per_million = config.services.usd_per_million_tokens
    price = None if per_million is None else TokenPrice(*per_million)
    try:
        twin_id, asked, remark = run_isolated(
            f"{__name__}:read_questions", twin_folder, config, model, price, limits=LIMITS
        )
    except (ProcessCrashed, MemoryError):
        limits = f"{LIMITS.seconds:g} s or {LIMITS.memory_bytes >> 30} GiB of memory"
        raise TwinError(f"{twin_folder}: the twin cannot be read within {limits}; build it again") from None
    annotator = VlmAnnotator(UnusedChatModel(model, price), config)
    topics = {prompt: topic for topic, names in PROMPTS.items() for prompt in names}
    questions = tuple(
        AskedQuestion(
            folder=f"{number}_{q.name}{f'_{q.vote + 1}' if q.name == 'grasp_points' else ''}",
            model=annotator.model_for(topics[q.name]) if q.name in topics else annotator.template_reader.model,
            answer_tokens=ANSWER_TOKENS[q.name] if q.name in topics else TEMPLATE_ANSWER_TOKENS[q.name],
            question=q,
            system=q.instructions if name == "anthropic" else instructions_with_schema(q),
        )
        for number, q in enumerate(asked, 1)
    )
    return AskedQuestions(twin_id, model, price, questions, remark)


def read_questions(
    twin_folder: Path, config: BuildConfig, model: str, price: TokenPrice | None
) -> tuple[str, list[Question], str]:
    """Return a twin's id, the questions about it and a remark on them; to be called in a process with limits."""
    twin = Twin(twin_folder)
    annotator = VlmAnnotator(UnusedChatModel(model, price), config)
    with tempfile.TemporaryDirectory() as folder:
        request = _request(twin, config, Path(folder))
        physical = twin.physical
        asked = annotator.questions(
            request, physical.material, np.array(physical.extents_m), _points_at_candidates(twin, request)
        )
        more, remark = template_questions(twin, request.subject, config.vlm, annotator.prompts)
    return twin.record.twin_id, [*asked, *more], remark


def _request(twin: Twin, config: BuildConfig, folder: Path) -> PointsRequest:
    """Return what the stages ask with, from what a finished twin still has; views are drawn anew into ``folder``."""
    physical, record = twin.physical, twin.record
    assert record.points is not None and record.grasps is not None and record.language is not None
    parts = twin.visual
    cameras, pictures = draw_views(parts, config.views, config.views.size_px or config.vlm.picture_px)
    views = []
    for index, picture in enumerate(pictures):
        views.append(folder / f"rgb_{index:02d}.webp")
        write_webp(picture, views[-1], config.views.webp_quality)
    surface = merge_parts(parts)
    positions, normals = np.array(record.points.candidates.positions_m), np.array(record.points.candidates.normals)
    for row in record.points.candidates.refined:  # where they were when the views were marked
        positions[row.candidate], normals[row.candidate] = row.marked_position_m, row.marked_normal
    caster, tolerance_m = RayCaster(surface), visibility_tolerance_m(surface.extents)
    seen = [visible_points(positions, normals, camera, caster, tolerance_m) for camera in cameras]
    subject = Subject(
        name=record.name,
        solid=surface,
        parts=tuple(parts),
        metric=True,
        views=tuple(views),
        cameras=tuple(cameras),
        seed=record.provenance.seed,
        known_as=record.language.category,
        photos=_photos(twin, config, folder),
        size_estimated=physical.scale_applied != 1.0,
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


def _points_at_candidates(twin: Twin, request: PointsRequest) -> list[FunctionalPoint]:
    """Return the functional points as they were chosen: at their candidates, before they moved to what they mean."""
    assert twin.record.points is not None
    return [point.model_copy(update=request.place(point.candidate)) for point in twin.record.points.functional]


def _photos(twin: Twin, config: BuildConfig, folder: Path) -> tuple[Path, ...]:
    """Return the photo that a twin was made of, cut out again; none where it was made of several, or of something else."""
    if twin.record.source.kind != "image":
        return ()
    photo = twin.folder / twin.record.source.file
    # what is doubted of a twin that was accepted, somebody has confirmed
    rgba, _ = PhotoStage(config.matting).cut_out(photo, twin.record.name, lambda doubted: doubted.matte)
    Image.fromarray(rgba).save(folder / "photo.png", compress_level=1)
    return (folder / "photo.png",)


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
        raise UsageError(f"{out} already exists and is not empty; give a new folder")
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
    price = asked.price
    lines = [
        f"# Prompts of {asked.model} for twin {asked.twin_id}",
        "",
        "Each folder is one prompt: `instructions.txt` (system message), `question.txt` (user message; file names mark the places"
        " of pictures), `schema.json` (JSON Schema of the answer). If an answer contradicts geometry or priors, the model is"
        " asked once more and told what is wrong; that costs about as much again.",
        "",
        asked.remark,
        "",
        "| question | asked with | pictures | tokens read | tokens written | USD |",
        "|---|---|---|---|---|---|",
    ]
    total, read_all, written_all = 0.0, 0, 0
    for one in asked.questions:
        read = estimated_usage(one.question, "").input_tokens
        written = one.answer_tokens
        usd = (
            0.0
            if price is None
            else (read * price.read_usd_per_million + written * price.written_usd_per_million) / 1e6
        )
        pictures = sum(isinstance(part, Picture) for part in one.question.parts)
        lines.append(f"| {one.folder} | {one.model} | {pictures} | {read} | {written} | {_usd(usd, price)} |")
        total, read_all, written_all = total + usd, read_all + read, written_all + written
    lines.append(f"| all | | | {read_all} | {written_all} | {_usd(total, price)} |")
    if price is None:
        lines += ["", "USD: set `services.usd_per_million_tokens = [read, written]` in the configuration."]
    lines += [
        "",
        "Token counts are estimates: one token per 4 characters, or per 28 x 28 pixels; models count differently.",
    ]
    return "\n".join(lines) + "\n"


def _usd(usd: float, price: TokenPrice | None) -> str:
    return "?" if price is None else f"{usd:.4f}"
