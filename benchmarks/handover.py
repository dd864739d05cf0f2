"""Print the results of handovers with the twins of a data set: attempted, executed, kept, and those of negative controls.

    python benchmarks/handover.py DATASET --seeds 10 --controls 5

Prints one row per twin. Twins without two grasps that allow a handover are left out. A negative control is the same episode with
an error of the second arm: it reaches 15 cm beside the object (beside; ``replan_failed`` where no such motion exists), or it does
not close its hand (open). None may be kept. CPU seconds are those of an attempt, including scene setup and planning.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Sequence

import numpy as np
from twin_bench import EXECUTED, TwinBench

from manitwin.episodes.courses.handover import TAKER
from manitwin.episodes.episode import run_episode
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.execution import Execution
from manitwin.episodes.planning.placement_choice import PlacementChoice
from manitwin.episodes.planning.problem import Grasp, PickPlaceProblem
from manitwin.episodes.planning.two_arms import TakePlan, TwoArmPlanner
from manitwin.episodes.setting import table_setting
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.registry import load_skill
from manitwin.episodes.target_grasps import shuffled, usable_grasps
from manitwin.geometry.poses import transform
from manitwin.scenes.layouts.pool import PoolTwin
from manitwin.scenes.loaded_scene import furniture_boxes

BESIDE_M = 0.15


class Deceived(TwoArmPlanner):
    """A planner whose second arm is given a position 15 cm beside the object once the first hand holds it."""

    def plan_take(
        self,
        problem: PickPlaceProblem,
        object_to_world: np.ndarray,
        giver_rad: np.ndarray,
        opening_m: float,
        giver_to_object: np.ndarray,
        put_down: PlacementChoice,
        first: Sequence[Grasp] = (),
    ) -> TakePlan | None:
        """Plan for the wrong position when a plan is made anew; None where no plan exists at any such position."""
        for angle in np.arange(0, 2 * np.pi, np.pi / 4) if first else ():
            way = BESIDE_M * np.array([np.cos(angle), np.sin(angle), 0.0])
            beside = transform(translation=way) @ object_to_world
            found = super().plan_take(problem, beside, giver_rad, opening_m, giver_to_object, put_down, first)
            if found is not None:
                return found
        if first:
            return None
        return super().plan_take(problem, object_to_world, giver_rad, opening_m, giver_to_object, put_down, first)


class Bench(TwinBench):
    """Handovers of the twins of one data set."""

    def __init__(self, dataset: str, robot: str):
        """Read the pool of twins."""
        super().__init__(dataset, robot)
        self.planners = {"": TwoArmPlanner(self.robot), "beside": Deceived(self.robot)}

    def attempt(self, target: PoolTwin, seed: int, wrong: str = "") -> tuple[EpisodeFacts, float]:
        """Return the facts of an episode, or of its negative control of the kind ``wrong``, and its CPU seconds."""
        began, rng, skill = time.process_time(), np.random.default_rng(seed), load_skill("handover")
        area = self.robot.workspace
        setting = table_setting(skill, target, self.pool, self.placeable, 0, area, rng, self.begins)
        if setting is None or setting.skill_goal is None:
            return EpisodeFacts("no_room"), time.process_time() - began
        grasps = shuffled(usable_grasps(self.source.twin(target.twin_id), self.robot.gripper), rng)
        problem = PickPlaceProblem(
            setting.task.objects[0],
            setting.task.goal_object_to_world,
            tuple(each.grasp for each in grasps),
            (),
            tuple(furniture_boxes(setting.furniture)),
            seed,
        )
        planner = self.planners.get(wrong, self.planners[""])
        close = Execution.close_hand
        try:
            if wrong == "open":
                Execution.close_hand = _close_but_the_taker  # type: ignore[method-assign]
            facts, _ = run_episode(problem, planner, self.robot, EpisodeSettings(), setting.skill_goal)
        finally:
            Execution.close_hand = close  # type: ignore[method-assign]
        return facts, time.process_time() - began


_close = Execution.close_hand


def _close_but_the_taker(execution: Execution) -> None:
    if execution.selected_arm != TAKER:
        _close(execution)


def main() -> None:
    """Print a row for each twin, and one for each kind of control."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--controls", type=int, default=5)
    parser.add_argument("--categories", default="", help="only twins of these")
    parser.add_argument("--robot", default="two_pandas")
    asked = parser.parse_args()
    bench, skill = Bench(asked.dataset, asked.robot), load_skill("handover")
    assert skill is not None
    for twin in (each for each in bench.pool.twins if skill.suits(bench.pool, each, None)):
        if asked.categories and twin.category not in asked.categories.split(","):
            continue
        if not bench.begins(skill, twin):
            print(f"{twin.category:16} takes no part: no two grasps lift it and put it down", flush=True)
            continue
        for wrong, count in (("", asked.seeds), ("beside", asked.controls), ("open", asked.controls)):
            done = [bench.attempt(twin, asked.first + number, wrong) for number in range(count)]
            outcomes = Counter(facts.outcome for facts, _ in done)
            executed = sum(found for outcome, found in outcomes.items() if outcome in EXECUTED)
            reasons = Counter(
                facts.evaluation.failure.split(": ")[1]
                for facts, _ in done
                if facts.evaluation is not None and facts.evaluation.failure is not None
            )
            unplanned = Counter(pair for facts, _ in done for pair in facts.unplanned)
            replans = sum((facts.replans for facts, _ in done), Counter[str]())
            cpu_s = float(np.median([spent for _, spent in done])) if done else 0.0
            print(
                f"{twin.category:16} {wrong or 'handover':9} {count} attempts, {executed} executed, "
                f"{outcomes['kept']} kept, {cpu_s:.1f} CPU-s; {dict(outcomes)} {dict(reasons)} {dict(replans)} {dict(unplanned)}",
                flush=True,
            )


if __name__ == "__main__":
    main()
