"""Print how skills of held paths do with the twins of a data set: attempts, executed, kept, and of their negative controls.

    python benchmarks/held_skills.py DATASET --skills hang,press,strike --seeds 40 --controls 10

One row a twin that can be used so. A negative control is the same episode with the whole path beside (3 cm; of a blow 9 cm, as
block and face are 5 cm wide), judged against what was asked for: none may be kept. CPU seconds are those of an attempt,
setting and planning included.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
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
from manitwin.scenes.loaded_scene import furniture_boxes
from manitwin.twin.loaded_twin import TwinSource

BESIDE_M = {"strike": 0.09, "insert": 0.15}
EXECUTED = {"kept", "unplanned_contact", "disturbed", *EXECUTION_FAILURES}


class Bench:
    """Episodes of one robot with the twins of one data set."""

    def __init__(self, dataset: str, robot: str):
        """Read the pool."""
        self.pool, self.source, self.robot = pool_of(dataset), TwinSource(dataset), load_robot(robot)
        self.planner = PickPlacePlanner(self.robot)

    def attempt(self, skill_name: str, target: PoolTwin, seed: int, beside_m: float) -> tuple[str, float]:
        """Return the outcome of an episode, its path so far beside, and its CPU seconds."""
        began, rng, skill = time.process_time(), np.random.default_rng(seed), load_skill(skill_name)
        setting = table_setting(skill, target, self.pool, self._placeable, 0, self.robot.workspace, rng)
        if setting is None or setting.skill_goal is None:
            return "no_room", time.process_time() - began
        goal = _moved(setting.skill_goal, beside_m, rng) if beside_m else setting.skill_goal
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


def _moved(goal: SkillGoal, beside_m: float, rng: np.random.Generator) -> SkillGoal:
    """Return a goal whose paths are beside: across the peg of a fixture, in a random direction without one."""
    make, angle = goal.path, rng.uniform(-np.pi, np.pi)
    assert make is not None
    way = np.array([np.cos(angle), np.sin(angle), 0.0])
    if goal.fixtures and goal.fixtures[0].kind == "peg":
        way = goal.fixtures[0].frame_to_world[:3, 1]
    off = transform(translation=beside_m * way)

    def beside(scene: HeldScene) -> HeldTask:
        task = make(scene)
        return replace(task, paths=tuple(replace(path, poses=off @ path.poses) for path in task.paths))

    return replace(goal, path=beside)


def main() -> None:
    """Print a row for each twin and skill, and one of the controls of each skill."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset")
    parser.add_argument("--skills", default="hang,press,strike")
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--controls", type=int, default=10)
    parser.add_argument("--robot", default="panda")
    asked = parser.parse_args()
    bench = Bench(asked.dataset, asked.robot)
    for name in asked.skills.split(","):
        skill, wrong, beside_m = load_skill(name), Counter[str](), BESIDE_M.get(name, 0.03)
        assert skill is not None
        for twin in bench.pool.twins:
            if not skill.suits(bench.pool, twin, None):
                continue
            ran = [bench.attempt(name, twin, asked.first + seed, 0.0) for seed in range(asked.seeds)]
            wrong.update(bench.attempt(name, twin, asked.first + seed, beside_m)[0] for seed in range(asked.controls))
            outcomes = Counter(outcome for outcome, _ in ran)
            executed = sum(count for outcome, count in outcomes.items() if outcome in EXECUTED)
            seconds = float(np.median([each for _, each in ran])) if ran else 0.0
            said = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.most_common())
            print(
                f"{name} {twin.category} {twin.twin_id[:4]}: {executed} of {len(ran)} executed, {outcomes['kept']} kept"
                f" ({said}); {seconds:.2f} CPU-s an attempt",
                flush=True,
            )
        print(f"{name}, {100 * beside_m:.0f} cm beside: {dict(wrong)}", flush=True)


if __name__ == "__main__":
    main()
