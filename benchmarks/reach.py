"""Print for each robot the share of verified grasps within its reach for twins on an empty table.

    python benchmarks/reach.py TWINS [--starts 2] [--robots panda ur5_panda ...]

A grasp counts as reachable if one of its two orientations has a collision-free inverse-kinematics solution and a straight
approach. For a twin without grasps of the robot's own gripper, those of another gripper are transferred, with the fingertips at
the verified positions.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from manitwin.episodes.pick_place_tasks import Placeable, PlacingArea, sample_task
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.episodes.target_grasps import usable_grasps
from manitwin.robots.load import load_robot, shipped_robots
from manitwin.scenes.layouts.pool import Pool, cached_pool
from manitwin.scenes.layouts.surroundings import make_furniture
from manitwin.scenes.loaded_scene import furniture_boxes
from manitwin.twin.loaded_twin import Twin, TwinSource


def shares(robot_name: str, source: TwinSource, pool: Pool, starts: int) -> tuple[int, list[float], list[str], float]:
    """Return the number of grasps checked, each twin's reachable share, the twins without any, and CPU seconds."""
    robot = load_robot(robot_name)
    planner, begun = PickPlacePlanner(robot), time.process_time()
    looked_at, found, without = 0, list[float](), list[str]()
    for number, twin in enumerate(pool.twins):
        loaded: Twin = source.twin(twin.twin_id)
        grasps = tuple(each.grasp for each in usable_grasps(loaded, robot.gripper))
        reached = []
        for start in range(starts):
            rng = np.random.default_rng([number, start])
            furniture = make_furniture("table", rng)
            task = sample_task(
                Placeable.in_likeliest_placement(pool, twin),
                _nobody,
                0,
                PlacingArea(robot.workspace, furniture.supports[0]),
                rng,
            )
            if task is None or not grasps:
                continue
            boxes = tuple(furniture_boxes(furniture))
            problem = PickPlaceProblem(task.objects[0], task.goal_object_to_world, grasps, (), boxes, seed=start)
            reached.append(planner.reachable_share(problem))
            looked_at += len(grasps)
        if not any(reached):
            without.append(twin.category)
        found.append(float(np.mean(reached)) if reached else 0.0)
    return looked_at, found, without, time.process_time() - begun


def _nobody() -> Placeable:
    raise AssertionError("there are no others on an empty table")


def main() -> None:
    """Print a row for each robot."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("twins", type=Path)
    parser.add_argument("--starts", type=int, default=2)
    parser.add_argument("--robots", nargs="+", default=list(shipped_robots()))
    asked = parser.parse_args()
    source, pool = TwinSource(str(asked.twins.resolve())), cached_pool(str(asked.twins.resolve()))
    for name in asked.robots:
        looked_at, found, without, spent_s = shares(name, source, pool, asked.starts)
        said = f"; none of: {', '.join(without)}" if without else ""
        print(
            f"{name}: {looked_at} grasps, {100 * np.mean(found):.1f} % reached (mean over twins), {spent_s:.0f} CPU-s{said}"
        )


if __name__ == "__main__":
    main()
