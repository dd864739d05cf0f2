"""BDDL export of tasks in LIBERO's dialect; whatever the dialect cannot express is listed instead of approximated.

Source: LIBERO 8f1084e, libero/libero/bddl_files/ and libero/libero/envs/predicates/ (``On``, ``In``). BDDL has no numbers, no
events, no sides and no orientations.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from manitwin.episodes.goals.goal import Literal
from manitwin.episodes.tasks.task_record import TaskRecord
from manitwin.scenes.scene import SceneRecord
from manitwin.twin.store import canonical_json, write_bytes_atomically

PREDICATES = {"on": "On", "in": "In"}
LEFT_OUT = "left_out.json"


@dataclass(frozen=True)
class Bddl:
    """A task's text, None if a literal of its goal cannot be expressed in BDDL; and everything that the text omits."""

    text: str | None
    left_out: tuple[str, ...]


def bddl_of(task: TaskRecord, scene: SceneRecord) -> Bddl:
    """Return a task in a scene as BDDL: the goal's literals; ``stays`` literals are omitted."""
    goal = task.parsed_goal
    unsaid = tuple(str(each) for each in goal.literals if not _is_expressible(each))
    if unsaid:
        return Bddl(None, unsaid)
    categories = {each.name: _symbol(each.category) for each in scene.objects}
    objects = "\n".join(f"    {name} - {category}" for name, category in sorted(categories.items()))
    init = "\n".join(
        f"    ({'In' if each.relation == 'in' else 'On'} {each.name} {each.supported_by or _symbol(each.surface)})"
        for each in sorted(scene.objects, key=lambda each: each.name)
    )
    surfaces = sorted({_symbol(each.surface) for each in scene.objects})
    fixtures = "\n".join(f"    {name} - {name}" for name in surfaces)
    goals = " ".join(f"({PREDICATES[each.predicate]} {each.subject} {each.second})" for each in goal.literals)
    interest = dict.fromkeys(name for each in goal.literals for name in (each.subject, each.second) if name)
    text = (
        f"(define (problem ManiTwin_{task.task_id})\n  (:domain robosuite)\n  (:language {_line(task.instructions[0])})\n"
        f"  (:fixtures\n{fixtures}\n  )\n  (:objects\n{objects}\n  )\n  (:obj_of_interest {' '.join(interest)})\n"
        f"  (:init\n{init}\n  )\n  (:goal\n    (And {goals})\n  )\n)\n"
    )
    return Bddl(text, tuple(f"{each} throughout" for each in goal.stays))


def write_bddl(tasks: Sequence[TaskRecord], scenes: dict[str, SceneRecord], folder: Path) -> tuple[int, int]:
    """Write ``TASK_ID.bddl`` for every expressible task, and ``left_out.json``; return the numbers of written and other tasks."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    left_out, written = {}, 0
    for task in tasks:
        said = bddl_of(task, scenes[task.scene_id])
        left_out[task.task_id] = {"written": said.text is not None, "left_out": list(said.left_out)}
        if said.text is not None:
            write_bytes_atomically(folder / f"{task.task_id}.bddl", said.text.encode())
            written += 1
    write_bytes_atomically(folder / LEFT_OUT, canonical_json(left_out).encode())
    return written, len(tasks) - written


def _is_expressible(literal: Literal) -> bool:
    return literal.predicate in PREDICATES and literal.second is not None and literal.value is None


def _symbol(text: str) -> str:
    return re.sub(r"[^0-9A-Za-z_]+", "_", text.strip()).strip("_") or "thing"


def _line(text: str) -> str:
    return " ".join(re.sub(r"[()]", " ", text).split())
