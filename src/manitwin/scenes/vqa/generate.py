"""Generation of questions about the pictures of scenes: drafting by scene, selection over all scenes, and wording."""

from __future__ import annotations

import random
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from manitwin.scenes.perception.scene_truth import SceneTruth
from manitwin.scenes.perception.splits import VALIDATION, split_of
from manitwin.scenes.vqa.context import Context, SceneMeasurements
from manitwin.scenes.vqa.detection import detection
from manitwin.scenes.vqa.functional_planning import functional_planning
from manitwin.scenes.vqa.language_grounding import language_grounding
from manitwin.scenes.vqa.posed_objects import TwinShape, picture_views, posed_objects_of
from manitwin.scenes.vqa.question import CHOICE, YES_NO, Draft, Question
from manitwin.scenes.vqa.references import find_references
from manitwin.scenes.vqa.rephrasing import fill_slots
from manitwin.scenes.vqa.scene_understanding import scene_understanding
from manitwin.scenes.vqa.selection import IN_ORDER, chosen
from manitwin.scenes.vqa.task_planning import task_planning
from manitwin.scenes.vqa.templates import FAMILIES

MOST_DRAFTS = 24
"""Maximal number of drafts of a family (and answer, for yes/no questions) that one scene keeps."""
_MAKERS: Sequence[Callable[[Context], Iterable[Draft]]] = (
    language_grounding,
    functional_planning,
    scene_understanding,
    task_planning,
    detection,
)


def drafts_of(
    scene: SceneTruth, shape_of: Callable[[str], TwinShape], categories: Sequence[str], seed: int
) -> list[Draft]:
    """Return the drafts of all possible questions about the pictures of a scene; raises TwinError, UsageError.

    ``categories`` are those of all scenes; absent ones are asked about.
    """
    things = posed_objects_of(scene, shape_of)
    found: list[Draft] = []
    measured = SceneMeasurements()
    for view in picture_views(scene, things):
        rng = random.Random(_seed(seed, scene.record.scene_id, view.name))
        context = Context(scene, things, view, find_references(view, rng), categories, rng, measured)
        for make in _MAKERS:
            found += (replace(draft, evidence=_with_words(draft, context)) for draft in make(context))
    return _limit_drafts(found, random.Random(_seed(seed, scene.record.scene_id, "thinned")))


def _with_words(draft: Draft, context: Context) -> dict[str, Any]:
    """Return a draft's evidence, with the references of its objects."""
    called = {name: context.words[name] for name in draft.evidence["objects"] if name in context.words}
    return {**draft.evidence, "called": called}


def _limit_drafts(drafts: Sequence[Draft], rng: random.Random) -> list[Draft]:
    """Limit the drafts of each family and, for yes/no questions, of each answer, so that a thousand scenes fit into memory."""
    sides: dict[tuple[str, str], list[Draft]] = defaultdict(list)
    for draft in drafts:
        sides[draft.family, draft.answer if draft.kind == YES_NO else ""].append(draft)
    return [draft for side in sides.values() for draft in rng.sample(side, min(len(side), MOST_DRAFTS))]


def questions_of(
    scene_ids: Sequence[str],
    drafts: Sequence[Sequence[Draft]],
    *,
    per_scene: int,
    validation_share: float,
    seed: int,
    wordings_for: Callable[[Sequence[str]], Mapping[str, Sequence[str]]] = lambda families: {},
) -> list[Question]:
    """Select among the drafts of scenes and word them; the split ``val`` uses the held-out paraphrases.

    ``wordings_for`` returns more wordings of the selected families, for the other split.
    """
    picked = chosen(drafts, per_scene, random.Random(_seed(seed, "chosen")))
    asked = {draft.family for of_scene in picked for draft in of_scene}
    wordings = wordings_for([family for family in FAMILIES if family in asked])
    found = []
    for scene_id, of_scene in zip(scene_ids, picked, strict=True):
        rng = random.Random(_seed(seed, scene_id, "words"))
        split = split_of(scene_id, validation_share)
        order = sorted(range(len(of_scene)), key=lambda place: (of_scene[place].camera, place))
        for number, place in enumerate(order):
            draft = of_scene[place]
            more = wordings.get(draft.family, ())
            found.append(_worded(draft, f"{scene_id}_{number:04d}", scene_id, split, rng, more))
    return found


def _worded(
    draft: Draft, question_id: str, scene_id: str, split: str, rng: random.Random, more: Sequence[str]
) -> Question:
    family = FAMILIES[draft.family]
    held_out = split == VALIDATION
    last = len(family.paraphrases) - 1
    template = last if held_out else rng.randrange(last + len(more))
    if not held_out and template >= last:
        template += 1  # skip the held-out paraphrase
    wordings = (*family.paraphrases, *more)
    text = fill_slots(wordings[template], draft.slots)
    draft = _shuffled(draft, rng)
    return Question(
        question_id=question_id, scene_id=scene_id, camera=draft.camera, split=split, category=family.category,
        family=draft.family, kind=draft.kind, template=template, held_out=held_out, question=text,
        answer=draft.answer, response=draft.response, options=draft.options, points=draft.points, boxes=draft.boxes,
        evidence=draft.evidence, rephrased=template > last,
    )  # fmt: skip


def _shuffled(draft: Draft, rng: random.Random) -> Draft:
    """Shuffle the options, except those in a fixed order: yes and no, numbers, sides, and options named in the question."""
    if draft.kind == YES_NO:
        return replace(draft, options=("yes", "no"))
    if draft.kind != CHOICE or draft.family in IN_ORDER:
        return draft
    return replace(draft, options=tuple(rng.sample(draft.options, len(draft.options))))


def _seed(seed: int, *names: str) -> int:
    return zlib.crc32("/".join(map(str, (seed, *names))).encode())
