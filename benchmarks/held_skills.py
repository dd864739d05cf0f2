"""Print the results of skills with the twins of a data set: attempted, executed, kept, and those of negative controls.

    python benchmarks/held_skills.py DATASET --skills hang,press,strike --seeds 40 --controls 10
    python benchmarks/held_skills.py DATASET --skills all --attempts 42 --first 81000 --controls 0
    python benchmarks/held_skills.py DATASET --skills all --seeds 0 --controls 40

Prints one row for each twin that a skill can use, with partners drawn at random; with ``--attempts`` one row per skill, over its
twins in turn. A negative control is the same episode with a deliberately wrong motion (``wrong_goals.CONTROLS``), judged against
the original goal. Of each kind ``--controls`` are judged per skill, over its twins in turn, with at most four times as many
attempts; none may be kept. ``--mass`` sets the mass of the twins, to find the mass up to which a hand succeeds, whatever mass
their grasps were verified with. CPU seconds are those of an attempt, including scene setup and planning.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from twin_bench import EXECUTED, TwinBench
from wrong_goals import CONTROLS, pushed_beside, wrong_goal

from manitwin.episodes.episode import run_episode
from manitwin.episodes.planning.level_space import must_stay_level
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.episodes.setting import table_setting
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.registry import load_skill
from manitwin.episodes.target_grasps import shuffled, usable_grasps
from manitwin.geometry.rigid_body import RigidBody
from manitwin.scenes.layouts.pool import Pool, PoolTwin
from manitwin.scenes.loaded_scene import furniture_boxes

JUDGED = {
    "kept",
    "unplanned_contact",
    "disturbed",
    "goal_missed",
}  # an object dropped on the way does not test the judge


class Bench(TwinBench):
    """Episodes of one robot with the twins of one data set."""

    def __init__(self, dataset: str, robot: str, mass_kg: float | None = None):
        """Read the pool of twins; with ``mass_kg`` they get this mass, with their own distribution of it."""
        super().__init__(dataset, robot)
        if mass_kg is not None:
            self.pool = Pool(self.pool.twins, partial(weighed, self.pool, mass_kg))
        self.planner = PickPlacePlanner(self.robot)

    def attempt(self, skill_name: str, target: PoolTwin, seed: int, wrong: str = "") -> tuple[str, float]:
        """Return the outcome of an episode, or of its negative control of the kind ``wrong``, and its CPU seconds."""
        began, rng, skill = time.process_time(), np.random.default_rng(seed), load_skill(skill_name)
        area = self.robot.workspace
        setting = table_setting(skill, target, self.pool, self.placeable, 0, area, rng, self.begins)
        if setting is None or setting.skill_goal is None:
            return "no_room", time.process_time() - began
        goal = setting.skill_goal
        if wrong:
            goal = wrong_goal(goal, skill_name, wrong, setting.task.objects, rng)
        grasps = shuffled(usable_grasps(self.source.twin(target.twin_id), self.robot.gripper), rng)
        problem = PickPlaceProblem(
            setting.task.objects[0],
            goal.poses[0],
            tuple(each.grasp for each in grasps),
            setting.task.objects[1:],
            tuple(furniture_boxes(setting.furniture)),
            seed,
            tuple(box for fixture in setting.fixtures for box in fixture.boxes),
            level=frozenset(
                each.name
                for each in setting.task.objects
                if must_stay_level(each, self.pool.body(each.twin_id).opening)
            ),
        )
        with pushed_beside(skill_name, wrong, rng):
            facts, _ = run_episode(problem, self.planner, self.robot, EpisodeSettings(), goal)
        return facts.outcome, time.process_time() - began

    def twins_of(self, skill_name: str, categories: Sequence[str]) -> list[PoolTwin]:
        """Return the twins that can be a skill's target, of the given categories or of all."""
        skill, found = load_skill(skill_name), list[PoolTwin]()
        assert skill is not None
        for twin in self.pool.twins:
            partners = [each for each in self.pool.twins if each is not twin] if skill.has_partner else [None]
            asked_for = not categories or twin.category in categories
            if asked_for and self.begins(skill, twin) and any(skill.suits(self.pool, twin, each) for each in partners):
                found.append(twin)
        return found

    def controls(self, skill_name: str, kind: str, twins: Sequence[PoolTwin], first: int, count: int) -> Counter[str]:
        """Return the outcomes of negative controls of a kind, until ``count`` have been judged."""
        outcomes = Counter[str]()
        for number in range(4 * count if twins else 0):
            outcomes[self.attempt(skill_name, twins[number % len(twins)], first + number, kind)[0]] += 1
            if sum(outcomes[each] for each in JUDGED) == count:
                break
        return outcomes

    def in_turn(self, skill_name: str, twins: Sequence[PoolTwin], first: int, count: int) -> list[tuple[str, float]]:
        """Return the outcomes and CPU seconds of ``count`` attempts, over the twins in turn, in a newly drawn order."""
        rng, order = np.random.default_rng(first), list[PoolTwin]()
        while len(order) < count:
            order += [twins[int(number)] for number in rng.permutation(len(twins))]
        return [self.attempt(skill_name, twin, first + number) for number, twin in enumerate(order[:count])]


def weighed(pool: Pool, mass_kg: float, twin_id: str) -> RigidBody:
    """Return a twin's rigid body with the mass ``mass_kg``."""
    body = pool.body(twin_id).body
    return replace(body, mass_kg=mass_kg, inertia_kg_m2=body.inertia_kg_m2 * (mass_kg / body.mass_kg))


def row(name: str, ran: Sequence[tuple[str, float]]) -> str:
    """Return a row: attempted, executed, kept, and the outcomes of the others."""
    outcomes = Counter(outcome for outcome, _ in ran)
    executed = sum(count for outcome, count in outcomes.items() if outcome in EXECUTED)
    seconds = float(np.median([each for _, each in ran]))
    said = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.most_common())
    kept = f"{executed} of {len(ran)} executed, {outcomes['kept']} kept ({outcomes['kept'] / max(1, executed):.1%}; {said})"
    return f"{name}: {kept}; {seconds:.2f} CPU-s an attempt"


def main() -> None:
    """Print a row for each twin and skill, and one for the controls of each skill."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset")
    parser.add_argument("--skills", default="hang,press,strike")
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--attempts", type=int, default=0, help="of a skill, over its twins in turn; instead of seeds")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--controls", type=int, default=10)
    parser.add_argument("--kinds", default="", help="only controls of these kinds, as empty,turned")
    parser.add_argument("--categories", default="", help="only twins of these")
    parser.add_argument("--robot", default="panda")
    parser.add_argument("--mass", type=float, help="kg that each twin weighs, instead of its own mass")
    asked = parser.parse_args()
    bench = Bench(asked.dataset, asked.robot, asked.mass)
    for name in CONTROLS if asked.skills == "all" else asked.skills.split(","):
        twins = bench.twins_of(name, asked.categories.split(",") if asked.categories else [])
        if asked.attempts and twins:
            ran = bench.in_turn(name, twins, asked.first, asked.attempts)
            print(row(f"{name}, {len({twin.twin_id for twin in twins})} twins", ran), flush=True)
        for twin in twins if asked.seeds and not asked.attempts else ():
            ran = [bench.attempt(name, twin, asked.first + seed) for seed in range(asked.seeds)]
            print(row(f"{name} {twin.category} {twin.twin_id[:4]}", ran), flush=True)
        kinds = [kind for kind in CONTROLS[name] if not asked.kinds or kind in asked.kinds.split(",")]
        for kind in kinds if asked.controls else ():
            outcomes = bench.controls(name, kind, twins, asked.first, asked.controls)
            judged = sum(count for outcome, count in outcomes.items() if outcome in JUDGED)
            print(f"{name}, {kind}: {outcomes['kept']} of {judged} kept; {dict(outcomes)}", flush=True)


if __name__ == "__main__":
    main()
