"""Data sets of questions about rendered scenes, in one format, with their report page."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from PIL import Image

from manitwin.errors import UsageError, unknown_name_message
from manitwin.formats.output_folder import new_folder
from manitwin.models.vlm.chat_from_spec import NO_CHAT, chat_of
from manitwin.scenes.perception.output import JPEG_QUALITY, Output
from manitwin.scenes.perception.scene_truth import PictureTruth, read_scene_truth
from manitwin.scenes.perception.segmentation import VALIDATION_SHARE
from manitwin.scenes.scene_files import dataset_of, scene_files
from manitwin.scenes.vqa.formats import FORMATS, Pictures
from manitwin.scenes.vqa.generate import drafts_of, questions_of
from manitwin.scenes.vqa.posed_objects import TwinShape
from manitwin.scenes.vqa.question import Draft, Question
from manitwin.scenes.vqa.rephrasing import Rephrasing, kept_wordings, rephrasings, rephrasings_json
from manitwin.scenes.vqa.report import vqa_page
from manitwin.scenes.vqa.wording import CONVENTIONS
from manitwin.twin.loaded_twin import TwinSource

PER_SCENE = 80
QUESTIONS = "questions.jsonl"
REPORT = "report.html"
REPHRASINGS = "rephrasings.json"
_PICTURES_KEPT = 8


@dataclass(frozen=True)
class VqaCounts:
    """The counts of a data set of questions."""

    scenes: int
    pictures: int
    questions: int
    families: int
    files: int
    rephrased: int


def generate_questions(
    files: Sequence[Path],
    *,
    dataset: str | Path | None = None,
    per_scene: int = PER_SCENE,
    validation_share: float = VALIDATION_SHARE,
    seed: int = 7,
    wordings_for: Callable[[Sequence[str]], Mapping[str, Sequence[str]]] = lambda families: {},
) -> tuple[list[Question], dict[str, PictureTruth]]:
    """Return the questions about rendered scenes, and their pictures by name; raises UsageError, TwinError.

    ``wordings_for`` returns more wordings of families.
    """
    source = TwinSource(dataset if dataset is not None else dataset_of(files[0]))
    shapes: dict[str, TwinShape] = {}

    def shape_of(twin_id: str) -> TwinShape:
        if twin_id not in shapes:
            shapes[twin_id] = TwinShape.of_twin(source.folder(twin_id))
        return shapes[twin_id]

    categories = sorted({thing.category for file in files for thing in read_scene_truth(file).record.objects})
    ids: list[str] = []
    drafts: list[list[Draft]] = []
    pictures: dict[str, PictureTruth] = {}
    for file in files:
        scene = read_scene_truth(file)
        ids.append(scene.record.scene_id)
        drafts.append(drafts_of(scene, shape_of, categories, seed))
        # copies without cached arrays: the labels of a thousand scenes do not fit into memory
        pictures |= {f"{scene.record.scene_id}_{each.name}.jpg": replace(each) for each in scene.pictures}
    questions = questions_of(
        ids, drafts, per_scene=per_scene, validation_share=validation_share, seed=seed, wordings_for=wordings_for
    )
    return questions, pictures


def write_vqa(
    scenes: str | Path,
    out: str | Path,
    form: str = "llava",
    *,
    dataset: str | Path | None = None,
    per_scene: int = PER_SCENE,
    points: str = "unit",
    validation_share: float = VALIDATION_SHARE,
    seed: int = 7,
    vlm: str = NO_CHAT,
) -> VqaCounts:
    """Write questions about rendered scenes with computed answers, atomically.

    ``scenes`` is the output of ``manitwin layout --pictures``, or one scene of it. ``dataset`` is the folder of its twins, by
    default the one that the run names. ``points`` is the convention of places. ``questions.jsonl`` contains the questions with
    their evidence, ``report.html`` samples and balance; the other files depend on the format. ``vlm`` is a model that rephrases
    the questions of the split ``train`` (``openai:MODEL@URL``); its wordings are in ``rephrasings.json``. Raises UsageError for
    an unknown format or convention, scenes without pictures or without any question, or an ``out`` that is not empty.
    """
    if form not in FORMATS:
        raise UsageError(unknown_name_message("format", form, FORMATS))
    if points not in CONVENTIONS:
        raise UsageError(unknown_name_message("convention of points", points, CONVENTIONS))
    if not 0 <= validation_share <= 1:
        raise UsageError(f"a validation share of {validation_share:g}; give 0 to 1")
    if per_scene < 1:
        raise UsageError(f"{per_scene} questions a scene; give 1 or more")
    files = scene_files(Path(scenes))
    if not files:
        raise UsageError(f"{scenes}: no scene there; `manitwin layout DATASET -o {scenes} --pictures` makes some")
    chat = chat_of(vlm, "word questions")
    given: list[Rephrasing] = []

    def wordings_for(families: Sequence[str]) -> Mapping[str, Sequence[str]]:
        if chat is not None:
            given.extend(rephrasings(families, chat))
        return kept_wordings(given)

    with new_folder(Path(out)) as folder:
        questions, pictures = generate_questions(
            files,
            dataset=dataset,
            per_scene=per_scene,
            validation_share=validation_share,
            seed=seed,
            wordings_for=wordings_for,
        )
        if not questions:
            raise UsageError(
                f"{scenes}: nothing can be asked about these pictures; sample scenes of two or more objects"
            )
        written = Output(folder)
        lines = "".join(json.dumps(each.to_json(), sort_keys=True, ensure_ascii=False) + "\n" for each in questions)
        written.write_bytes(QUESTIONS, lines.encode())
        if chat is not None:
            told = rephrasings_json(given, chat.model)
            written.write_bytes(REPHRASINGS, json.dumps(told, indent=1, ensure_ascii=False).encode() + b"\n")
        sizes = {name: (each.camera.width_px, each.camera.height_px) for name, each in pictures.items()}
        FORMATS[form](questions, Pictures(_jpegs(pictures), sizes), points, written)
        shown = vqa_page(questions, lambda each: replace(pictures[each.picture]).rgb, points, len(files))
        written.write_bytes(REPORT, shown)
        count = written.written
    families = len({each.family for each in questions})
    rephrased = sum(each.rephrased for each in questions)
    return VqaCounts(len(files), len({each.picture for each in questions}), len(questions), families, count, rephrased)


def _jpegs(pictures: Mapping[str, PictureTruth]) -> Callable[[str], bytes]:
    @lru_cache(maxsize=_PICTURES_KEPT)
    def jpeg(name: str) -> bytes:
        stream = io.BytesIO()
        Image.fromarray(replace(pictures[name]).rgb).save(stream, "JPEG", quality=JPEG_QUALITY, subsampling=0)
        return stream.getvalue()

    return jpeg
