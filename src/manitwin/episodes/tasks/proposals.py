"""Tasks proposed by a language model: literals over a scene's objects in a strict schema, without code or new predicates."""

from __future__ import annotations

from collections import Counter
from enum import Enum
from typing import Any

from pydantic import BaseModel, ConfigDict, create_model

from manitwin.episodes.skills.robot_compatibility import skills_of
from manitwin.episodes.tasks.candidates import Candidate, SkillAction, single_actions, undoes
from manitwin.episodes.tasks.task_scene import TaskScene
from manitwin.models.vlm.client import ChatClient
from manitwin.models.vlm.protocol import Question
from manitwin.models.vlm.strict_schema import strict_schema
from manitwin.models.vlm.structured import ask
from manitwin.robots.robot import Robot

NOTHING = "nothing"
MOST_LITERALS = 2
INSTRUCTIONS = (
    "You propose tasks for {robot} at a table. A task is a goal: one or two literals that are to"
    " become true one after the other, each a predicate about an object and, where it needs one, a second object. Propose what a"
    " person would want done with these things. Use only the predicates and the objects that are listed, and answer in JSON."
)


def propose(scene: TaskScene, chat: ChatClient, count: int) -> tuple[list[Candidate], dict[str, int]]:
    """Ask a model for tasks in a scene; return the valid ones, and the number of rejected ones by reason.

    Raises the model's errors, and BadReply for an answer that does not match the schema.
    """
    answer = answer_type(scene)
    question = Question(
        "task_proposals",
        INSTRUCTIONS.format(robot=_robot_description(scene.robot)),
        (scene_description(scene, count),),
        strict_schema(answer),
    )
    said: Any = ask(chat, question, answer).value
    possible = {_key(action): action for action in single_actions(scene, Counter())}
    found, thrown = list[Candidate](), Counter[str]()
    for task in said.tasks[:count]:
        actions = []
        for literal in task.literals[:MOST_LITERALS]:
            second = literal.b.value
            key = literal.predicate.value, literal.a.value, None if second == NOTHING else second
            actions.append(possible.get(key))
        chosen = [action for action in actions if action is not None]
        why = _rejection_reason(actions, len(task.literals), chosen)
        if why is not None:
            thrown[f"proposed_{why}"] += 1
        else:
            found.append(Candidate(tuple(chosen)))
    thrown["proposed_too_many"] += max(0, len(said.tasks) - count)
    return found, {name: number for name, number in thrown.items() if number}


def answer_type(scene: TaskScene) -> type[BaseModel]:
    """Return the schema type of an answer: object names and the predicates of all skills are enumerations."""
    names = Enum("Object", {name: name for name in scene.names}, type=str)  # type: ignore[misc]
    seconds = Enum("Second", {name: name for name in (*scene.names, NOTHING)}, type=str)  # type: ignore[misc]
    known = sorted({skill.predicate for skill in skills_of(scene.robot)})
    predicates = Enum("Predicate", {name: name for name in known}, type=str)  # type: ignore[misc]
    strict = ConfigDict(extra="forbid")
    literal = create_model("Literal", __config__=strict, predicate=(predicates, ...), a=(names, ...), b=(seconds, ...))
    task = create_model("Task", __config__=strict, instruction=(str, ...), literals=(list[literal], ...))  # type: ignore[valid-type]
    return create_model("TaskProposals", __config__=strict, tasks=(list[task], ...))  # type: ignore[valid-type]


def scene_description(scene: TaskScene, count: int) -> str:
    """Return a textual description of the objects, their positions, and the predicates."""
    lines = [
        f"Propose up to {count} tasks. The objects, as the robot at the origin sees them (x ahead, y to its left, metres):"
    ]
    for placed in scene.objects:
        language = scene.words.get(placed.name)
        x_m, y_m = placed.object_to_world[:2, 3]
        lines.append(f"- {placed.name}: {language.category if language else 'unknown'} at x {x_m:.2f}, y {y_m:.2f}")
    lines.append("The predicates; b is an object, or nothing:")
    told = {skill.predicate: skill.has_partner for skill in skills_of(scene.robot)}
    lines += [f"- {name}(a, b)" if pair else f"- {name}(a), b nothing" for name, pair in sorted(told.items())]
    return "\n".join(lines)


def _robot_description(robot: Robot) -> str:
    if robot.arms:
        return "two robot arms with two-finger grippers that face each other"
    hands = {"parallel": "a two-finger gripper", "suction": "a suction cup"}
    return f"a robot arm with {hands.get(robot.gripper.kind, 'a hand of several fingers')}"


def _rejection_reason(actions: list[SkillAction | None], literals: int, chosen: list[SkillAction]) -> str | None:
    if not 1 <= literals <= MOST_LITERALS:
        return "wrong_number_of_literals"
    if len(chosen) < len(actions):
        return "impossible"
    return "undoes_first" if len(chosen) > 1 and undoes(*chosen) else None


def _key(action: SkillAction) -> tuple[str, str, str | None]:
    literal = action.literal
    return literal.predicate, literal.subject, literal.second if action.partner is not None else None
