"""Print how skills of held paths do with the twins of a data set: attempts, executed, kept, and of their negative controls.

    python benchmarks/held_skills.py DATASET --skills hang,press,strike --seeds 40 --controls 10

One row a twin that can be used so. A negative control is the same episode, judged against what was asked for, with the whole
path beside (3 cm; of a blow 9 cm, as block and face are 5 cm wide; of wiping, cutting, aiming and inserting 15 cm), 4 cm higher
(raised), or asked of another side of the thing than the one that is used (turned, its frames by 90 degrees about their X): none
may be kept. CPU seconds are those of an attempt, setting and planning included.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from manitwin.episodes.attempts import EXECUTION_FAILURES
from manitwin.episodes.episode import run_episode
from manitwin.episodes.pick_place_tasks import Placeable
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.episodes.setting import table_setting
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.skills.registry import load_skill
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.episodes.target_grasps import shuffled, usable_grasps
from manitwin.geometry.poses import transform
from manitwin.robots.load import load_robot
from manitwin.scenes.layouts.pool import PoolTwin, pool_of
from manitwin.scenes.layouts.twin_frames import TwinFrame
from manitwin.scenes.loaded_scene import furniture_boxes
from manitwin.twin.loaded_twin import TwinSource

BESIDE_M = {"strike": 0.09, "insert": 0.15, "wipe": 0.15, "cut_motion": 0.15, "aim": 0.15}
RAISED_M = 0.04
CONTROLS = {
    "wipe": ("beside", "turned", "raised"),
    "cut_motion": ("beside", "turned", "raised"),
    "aim": ("beside", "turned"),
}
EXECUTED = {"kept", "unplanned_contact", "disturbed", *EXECUTION_FAILURES}


class Bench:
    """Episodes of one robot with the twins of one data set."""

    def __init__(self, dataset: str, robot: str):
        """Read the pool."""
        self.pool, self.source, self.robot = pool_of(dataset), TwinSource(dataset), load_robot(robot)
        self.planner = PickPlacePlanner(self.robot)

    def attempt(self, skill_name: str, target: PoolTwin, seed: int, wrong: str = "") -> tuple[str, float]:
        """Return the outcome of an episode, or of its negative control of a kind, and its CPU seconds."""
        began, rng, skill = time.process_time(), np.random.default_rng(seed), load_skill(skill_name)
        setting = table_setting(skill, target, self.pool, self._placeable, 0, self.robot.workspace, rng)
        if setting is None or setting.skill_goal is None:
            return "no_room", time.process_time() - began
        goal = _wrong(setting.skill_goal, wrong, BESIDE_M.get(skill_name, 0.03), rng) if wrong else setting.skill_goal
        grasps = shuffled(usable_grasps(self.source.twin(target.twin_id), self.robot.gripper), rng)
        problem = PickPlaceProblem(
            setting.task.objects[0],
            setting.task.goal_object_to_world,
            tuple(each.grasp for each in grasps),
            setting.task.objects[1:],
            tuple(furniture_boxes(setting.furniture)),
            seed,
            tuple(box for fixture in setting.fixtures for box in fixture.boxes),
        )
        facts, _ = run_episode(problem, self.planner, self.robot, EpisodeSettings(), goal)
        return facts.outcome, time.process_time() - began

    def _placeable(self, twin: PoolTwin) -> Placeable:
        return Placeable.of(self.pool, twin)


def _wrong(goal: SkillGoal, kind: str, beside_m: float, rng: np.random.Generator) -> SkillGoal:
    """Return a goal whose paths are beside (across the peg of a fixture, else in a random direction), raised, or turned."""
    make, angle = goal.path, rng.uniform(-np.pi, np.pi)
    assert make is not None
    way = np.array([np.cos(angle), np.sin(angle), 0.0])
    if goal.fixtures and goal.fixtures[0].kind == "peg":
        way = goal.fixtures[0].frame_to_world[:3, 1]
    offs = {"beside": beside_m * way, "raised": np.array([0.0, 0, RAISED_M])}
    off = transform(translation=offs.get(kind, np.zeros(3)))

    def another(scene: HeldScene) -> HeldTask:
        task = make(scene)
        if kind == "turned":
            return replace(task, watch=make(replace(scene, frames=_turned(scene.frames))).watch)
        return replace(task, paths=tuple(replace(path, poses=off @ path.poses) for path in task.paths))

    return replace(goal, path=another)


def _turned(frames: Mapping[str, tuple[TwinFrame, ...]]) -> dict[str, tuple[TwinFrame, ...]]:
    aside = transform(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]))
    return {
        name: tuple(replace(each, frame_to_object=each.frame_to_object @ aside) for each in of_it)
        for name, of_it in frames.items()
    }


def main() -> None:
    """Print a row for each twin and skill, and one of the controls of each skill."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset")
    parser.add_argument("--skills", default="hang,press,strike")
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--controls", type=int, default=10)
    parser.add_argument("--categories", default="", help="only twins of these")
    parser.add_argument("--robot", default="panda")
    asked = parser.parse_args()
    bench = Bench(asked.dataset, asked.robot)
    for name in asked.skills.split(","):
        skill, controls = load_skill(name), CONTROLS.get(name, ("beside",))
        assert skill is not None
        wrong = {kind: Counter[str]() for kind in controls}
        for twin in bench.pool.twins:
            partners = [each for each in bench.pool.twins if each is not twin] if skill.has_partner else [None]
            if not any(skill.suits(bench.pool, twin, each) for each in partners):
                continue
            if asked.categories and twin.category not in asked.categories.split(","):
                continue
            ran = [bench.attempt(name, twin, asked.first + seed) for seed in range(asked.seeds)]
            for kind, counted in wrong.items():
                counted.update(bench.attempt(name, twin, asked.first + seed, kind)[0] for seed in range(asked.controls))
            outcomes = Counter(outcome for outcome, _ in ran)
            executed = sum(count for outcome, count in outcomes.items() if outcome in EXECUTED)
            seconds = float(np.median([each for _, each in ran])) if ran else 0.0
            said = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.most_common())
            print(
                f"{name} {twin.category} {twin.twin_id[:4]}: {executed} of {len(ran)} executed, {outcomes['kept']} kept"
                f" ({said}); {seconds:.2f} CPU-s an attempt",
                flush=True,
            )
        for kind, counted in wrong.items():
            print(f"{name}, {kind}: {dict(counted)}", flush=True)


if __name__ == "__main__":
    main()
