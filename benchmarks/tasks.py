"""Print the results of scene tasks drawn evenly over kinds: executed, kept, and replayed in their environments.

    python benchmarks/tasks.py SCENES OUT --count 500 --jobs 2
    python benchmarks/tasks.py SCENES OUT --plannable 16

Tasks are made in all scenes (``OUT/tasks``, as ``manitwin tasks`` does). ``--count`` of them are drawn (``OUT/drawn``), from each
kind in turn and a quarter with two literals, and executed once each (``OUT/episodes``). A task is only made if it could be
planned, so all drawn ones are plannable, and one that is not executed counts as not kept. With ``--replay`` each kept episode's
actions are executed in ``make_env``, which must judge them a success, and the states must equal those recorded bit for bit. A run
with the same arguments continues where the last one ended.

``--plannable`` instead checks all candidates with one literal of that many scenes, in ``--jobs`` processes.
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict, deque
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from itertools import islice
from math import ceil
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

import manitwin
from manitwin.config import RunConfig
from manitwin.episodes.attempts import ATTEMPTS, read_attempts
from manitwin.episodes.collect import batch_folders, collect, stored_episodes
from manitwin.episodes.episodes_run import EpisodesSource, make_episodes
from manitwin.episodes.planning.two_arms import planner_of
from manitwin.episodes.recording import Recording
from manitwin.episodes.settings import TasksConfig, TrajectoriesConfig
from manitwin.episodes.target_grasps import usable_grasps
from manitwin.episodes.tasks.candidates import Candidate, single_actions
from manitwin.episodes.tasks.feasibility_check import InfeasibleTask, check_candidate
from manitwin.episodes.tasks.task_files import TASKS, read_tasks, write_tasks
from manitwin.episodes.tasks.task_record import TaskRecord
from manitwin.episodes.tasks.task_scene import TaskScene
from manitwin.episodes.tasks.tasks_run import make_tasks
from manitwin.robots.load import load_robot
from manitwin.scenes.layouts.pool import cached_pool
from manitwin.scenes.loaded_scene import Scene
from manitwin.scenes.scene_files import scene_ids, scene_name
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.proportions import wilson_interval

SPARE = 2.0  # factor of tasks made per task drawn: rare kinds are not in every scene
TWO_LITERAL_SHARE = 0.25
CONFIG = "config.json"


def drawn_evenly(tasks: Sequence[TaskRecord], count: int, rng: np.random.Generator) -> list[TaskRecord]:
    """Return ``count`` tasks, of each kind in turn; a quarter has two literals, as far as there are such."""
    two = [task for task in tasks if len(task.steps) > 1]
    chosen = _in_turn(two, round(TWO_LITERAL_SHARE * count), rng)
    return chosen + _in_turn([task for task in tasks if len(task.steps) == 1], count - len(chosen), rng)


def _in_turn(tasks: Sequence[TaskRecord], count: int, rng: np.random.Generator) -> list[TaskRecord]:
    of_kind: dict[str, deque[TaskRecord]] = defaultdict(deque)
    for place in rng.permutation(len(tasks)):
        of_kind[tasks[int(place)].kind].append(tasks[int(place)])
    chosen = list[TaskRecord]()
    while len(chosen) < count and any(of_kind.values()):
        chosen += [left.popleft() for _, left in sorted(of_kind.items()) if left][: count - len(chosen)]
    return chosen


def share(name: str, right: int, of: int, rest: str = "") -> str:
    """Return a row with a share and its 95 % confidence interval."""
    low, high = wilson_interval(right, of)
    return f"{name:28} {right:4} of {of:4} = {right / max(1, of):6.1%} ({low:.0%} to {high:.0%}) {rest}"


def plannable_of(scenes: Path, robot_name: str, seed: int, scene_id: str) -> tuple[Counter[str], Counter[str]]:
    """Return how many candidates with one literal a scene has of each kind, and how many of these can be planned."""
    source, robot, settings = EpisodesSource.detect(scenes, None), load_robot(robot_name), TasksConfig(seed=seed)
    twins, planner = TwinSource(source.dataset), planner_of(robot, settings.episode.timestep_s)
    loaded = Scene.read(scenes / scene_name(scene_id), source.dataset)
    grasps = cache(lambda twin_id: usable_grasps(twins.twin(twin_id), robot.gripper))
    scene, rng = (
        TaskScene(loaded, cached_pool(source.dataset), robot, grasps),
        np.random.default_rng([seed, crc32(scene_id.encode())]),
    )
    candidates, plannable = Counter[str](), Counter[str]()
    for action in single_actions(scene, Counter()):
        candidates[action.kind] += 1
        try:
            check_candidate(scene, Candidate((action,)), planner, settings.episode, int(rng.integers(1 << 62)))
        except InfeasibleTask:
            continue
        plannable[action.kind] += 1
    return candidates, plannable


def print_plannable(scenes: Path, count: int, robot: str, seed: int, jobs: int) -> None:
    """Print a row for each scene and kind, and one for all."""
    ids = scene_ids(scenes)[:count]
    every, able = Counter[str](), Counter[str]()
    of_scene = list[int]()
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        for scene_id, (candidates, plannable) in zip(
            ids, pool.map(partial(plannable_of, scenes, robot, seed), ids), strict=True
        ):
            every, able = every + candidates, able + plannable
            of_scene.append(plannable.total())
            print(f"{scene_id}: {plannable.total()} of {candidates.total()}, of {len(plannable)} kinds", flush=True)
    for kind, number in sorted(every.items()):
        print(share(kind, able[kind], number))
    mean, low, high = np.mean(of_scene), min(of_scene), max(of_scene)
    print(f"a scene: {every.total() / len(ids):.0f} candidates, {mean:.0f} plannable ({low} to {high})")


def replayed(tasks: Path, episodes: Path, jobs: int) -> tuple[int, int, int]:
    """Execute the actions of every kept episode in its task's environment.

    Returns the number of successes, the number with joints, hands and objects equal to the recording bit for bit, and the number
    of episodes.
    """
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        counts = list(pool.map(partial(replay_part, tasks, episodes, jobs), range(jobs)))
    good, exact, count = (sum(each) for each in zip(*counts, strict=True))
    return good, exact, count


def replay_part(tasks: Path, episodes: Path, parts: int, part: int) -> tuple[int, int, int]:
    """Execute the actions of every ``parts``-th kept episode, from ``part`` on; returns the same as ``replayed``."""
    good = exact = count = 0
    for episode in islice(stored_episodes(batch_folders(episodes)), part, None, parts):
        recording, info = episode.recording, {"success": False}
        env = manitwin.make_env(tasks, episode.attempt.task_id)
        env.reset(seed=0)
        actions = np.column_stack([recording.action_joint_positions_rad, recording.action_hand]).astype(np.float32)
        first_other = None
        for number, action in enumerate(actions, start=1):
            seen, _, terminated, _, info = env.step(action)
            if first_other is None and not is_recorded(seen, recording, number):
                first_other = number
            if terminated:
                break
        env.close()
        good, exact, count = good + bool(info["success"]), exact + (first_other is None), count + 1
        if not info["success"] or first_other is not None:
            print(
                f"success {info['success']}, first other state {first_other} of {recording.steps}: "
                f"{episode.attempt.task_id} {episode.attempt.goal}",
                flush=True,
            )
    return good, exact, count


def is_recorded(seen: Mapping[str, Any], recording: Recording, number: int) -> bool:
    """Tell whether an observation equals the recorded state with the given number bit for bit."""
    pairs = (
        (seen["object_poses"][:, :3], recording.object_positions_m[number]),
        (seen["joint_positions_rad"], recording.joint_positions_rad[number]),
        (seen["gripper_opening_m" if "gripper_opening_m" in seen else "hand"], recording.hand[number]),
    )
    return all(np.array_equal(now, then) for now, then in pairs)


def main() -> None:
    """Make, draw and execute tasks, and print a row for each kind and one for all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--robot", default="panda")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--replay", action="store_true")
    parser.add_argument("--plannable", type=int, metavar="SCENES", help="check all candidates of so many scenes")
    asked = parser.parse_args()
    if asked.plannable:
        print_plannable(asked.scenes, asked.plannable, asked.robot, asked.seed, asked.jobs)
        return
    run = RunConfig(cpu=asked.jobs)
    per_scene = ceil(SPARE * asked.count / len(scene_ids(asked.scenes)))
    made, drawn, episodes = (asked.out / name for name in ("tasks", "drawn", "episodes"))
    config = TasksConfig(seed=asked.seed, robot=asked.robot, per_scene=per_scene, run=run)
    _, totals = make_tasks(asked.scenes, made, config)
    if totals is not None:
        print(
            f"{totals.scenes} scenes, {totals.candidates} candidates, {totals.plannable} of {totals.checked} plannable"
        )
    tasks = drawn_evenly(read_tasks(made), asked.count, np.random.default_rng(asked.seed))
    drawn.mkdir(parents=True, exist_ok=True)
    (drawn / CONFIG).write_bytes((made / CONFIG).read_bytes())
    write_tasks(drawn / TASKS, tasks)
    make_episodes(drawn, episodes, len(tasks), TrajectoriesConfig(seed=asked.seed, run=run))
    collect(episodes, [])
    kinds, outcomes = {task.task_id: task.kind for task in tasks}, defaultdict[str, Counter[str]](Counter)
    for attempt in read_attempts(episodes / ATTEMPTS):
        outcomes[kinds[str(attempt.task_id)]][attempt.outcome] += 1
    for kind, counted in sorted(outcomes.items()):
        rest = ", ".join(f"{number} {outcome}" for outcome, number in counted.most_common() if outcome != "kept")
        print(share(kind, counted["kept"], counted.total(), rest))
    kept = sum(counted["kept"] for counted in outcomes.values())
    print(share("all", kept, sum(counted.total() for counted in outcomes.values())))
    if asked.replay:
        good, exact, count = replayed(drawn, episodes, asked.jobs)
        print(share("a success again", good, count))
        print(share("to the bit", exact, count))


if __name__ == "__main__":
    main()
