"""Task candidates: skills applicable in a scene by annotations, sizes, openings and reach; rejections are counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from manitwin.episodes.goals.evaluation import evaluate
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.goals.goal_instructions import is_fixture_unambiguous
from manitwin.episodes.naming import is_distinguishable
from manitwin.episodes.skills.robot_compatibility import skills_of
from manitwin.episodes.tasks.task_record import kind_of
from manitwin.episodes.tasks.task_scene import TaskScene


@dataclass(frozen=True)
class SkillAction:
    """A skill applied to a target and a partner, by their numbers in the scene, with its goal."""

    skill: str
    target: int
    partner: int | None
    goal: Goal

    @property
    def kind(self) -> str:
        """The goal's predicate."""
        return kind_of(self.goal)

    @property
    def literal(self) -> Literal:
        """The literal to achieve."""
        return self.goal.literals[0]


@dataclass(frozen=True)
class Candidate:
    """One action, or several in order."""

    actions: tuple[SkillAction, ...]

    @property
    def kind(self) -> str:
        """The predicates of all actions, sorted and joined by ``+``."""
        return "+".join(sorted(action.kind for action in self.actions))


def single_actions(scene: TaskScene, dropped: Counter[str]) -> list[SkillAction]:
    """Return every action allowed by sizes, openings, reach and names, each literal once; count rejections in ``dropped``."""
    found: dict[str, SkillAction] = {}
    able = []
    for number in range(len(scene.objects)):
        why = scene.grasp_rejection(number)
        if why is None:
            able.append(number)
        else:
            dropped[why] += 1
    twins = [scene.pool.twin(each.twin_id) for each in scene.objects]
    unnamed = {number for number in range(len(scene.objects)) if not _is_named(scene, number)}
    for skill in skills_of(scene.robot):
        for target in able:
            partners = [each for each in range(len(twins)) if each != target] if skill.has_partner else [None]
            for partner in partners:
                if not skill.suits(scene.pool, twins[target], None if partner is None else twins[partner]):
                    dropped["does_not_fit"] += 1
                    continue
                second = None if partner is None else scene.objects[partner]
                goal = skill.goal(scene.objects[target], second)
                key = str(goal.literals[0])
                if key in found:
                    continue  # the same goal by another skill
                others = [twin.category for number, twin in enumerate(twins) if number != target]
                if {target, partner} & unnamed or not is_fixture_unambiguous(skill.predicate, others):
                    dropped["ambiguous_name"] += 1
                elif _is_true_already(scene, goal):
                    dropped["true_already"] += 1
                else:
                    found[key] = SkillAction(skill.name, target, partner, goal)
    return list(found.values())


def pairs_of(actions: list[SkillAction]) -> Iterator[Candidate]:
    """Yield ordered pairs of actions of which the second does not undo the first."""
    for first in actions:
        for second in actions:
            if first is not second and not undoes(first, second):
                yield Candidate((first, second))


def undoes(first: SkillAction, second: SkillAction) -> bool:
    """Tell whether the second action moves the first one's partner, or repeats its predicate or partner for the same target."""
    if second.target == first.partner or (first.target, first.kind) == (second.target, second.kind):
        return True
    return first.target == second.target and first.partner == second.partner is not None


def _is_named(scene: TaskScene, number: int) -> bool:
    """Tell whether an object has a name that fits no other object of the scene."""
    name = scene.names[number]
    others = [language for other, language in scene.words.items() if other != name]
    return name in scene.words and is_distinguishable(scene.words[name], others)


def _is_true_already(scene: TaskScene, goal: Goal) -> bool:
    """Tell whether a literal is true at the start, judged by poses; goals with places or fixtures are not."""
    spatial = all(literal.second is None or literal.second in scene.names for literal in goal.literals)
    return spatial and bool(evaluate(scene.state, Goal(goal.literals)).true_already)
