"""Pick and place from estimated poses: planned with the estimated scene, executed in the true scene.

    python benchmarks/locate_episodes.py DATASET SCENES... [--robot panda] [--most N] [--seed N] [--least SHARE] [-o FILE]

The scenes are those of ``manitwin layout DATASET --pictures --robot panda``. One camera of each scene is used, with the noise of
a depth camera and true masks. Every object with a visible share of at least ``--least`` (0.3) is located. A layout is made from
the view, in which objects that were not located are boxes. Each located object is then requested in turn. It counts if at least
one of its verified grasps is free of everything visible and within reach of the arm. The plan, made in the estimated layout
alone, is executed to its end in the true scene without further perception and without any use of the simulated poses. Success is
defined as for ``manitwin trajectories``: within 20 mm and 10 degrees of where the same motion takes the true object, released, at
rest, with no other object moved or touched.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.episodes.courses.course import EpisodeEnded, EpisodeStart
from manitwin.episodes.courses.pick_place import PickPlaceCourse
from manitwin.episodes.episode import closing_of, create_world, settle_start, tip_poses_of
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.execution import Execution
from manitwin.episodes.judging import judge
from manitwin.episodes.located_view import LocatedView
from manitwin.episodes.pick_place_tasks import PlacingArea, free_goal
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.target_grasps import usable_grasps
from manitwin.geometry.poses import inverse
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.robots.load import load_robot
from manitwin.scenes.loaded_scene import furniture_boxes, object_pose
from manitwin.scenes.locate.depth_noise import DepthNoise
from manitwin.scenes.locate.depth_view import view_of_camera
from manitwin.scenes.locate.estimate import locate_in_view, pose_distances_m
from manitwin.scenes.locate.located_scene import LocatedScene
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.recognition import ViewedObject
from manitwin.scenes.perception.bop import OPENGL_TO_OPENCV
from manitwin.scenes.perception.scene_truth import SceneTruth, read_scene_truth
from manitwin.twin.loaded_twin import Twin, TwinSource

LEAST_PX, RIGHT = 200, 0.1


class AsPlanned(PickPlaceCourse):
    """Pick and place exactly as planned, without updating the object's pose during execution."""

    def execute(self, execution: Execution) -> None:
        """Execute the plan to its end."""
        plan = self._plan
        self.grasp_and_lift(execution, plan.reach, plan.approach, plan.lift)
        for motion in (plan.carry, plan.lower):
            execution.follow(motion)
            self.check_held(execution)
        execution.open_hand()
        execution.follow(plan.retreat)


class Asked:
    """Settings that are the same for all scenes."""

    def __init__(self, dataset: Path, robot: str):
        self.source, self.robot = TwinSource(dataset), load_robot(robot)
        self.settings = EpisodeSettings()
        self.planner = PickPlacePlanner(self.robot, timestep_s=self.settings.timestep_s)
        self.twins: dict[str, Twin] = {}
        self.models: dict[str, PoseModel] = {}

    def twin(self, twin_id: str) -> Twin:
        """Return a twin, read once."""
        if twin_id not in self.twins:
            self.twins[twin_id] = self.source.twin(twin_id)
            self.models[twin_id] = PoseModel.of_twin(self.twins[twin_id])
        return self.twins[twin_id]


def rows_of(asked: Asked, truth: SceneTruth, camera: int, least: float, seed: int) -> list[dict[str, Any]]:
    """Locate the objects of a scene once, try every graspable located one, and return a row for each."""
    picture, rng = truth.pictures[camera % len(truth.pictures)], np.random.default_rng([seed, truth.record.number])
    view = view_of_camera(picture.camera, DepthNoise().simulate_depth(picture.depth_m, rng), picture.rgb)
    world_to_camera = OPENGL_TO_OPENCV @ inverse(picture.camera.camera_to_object)
    things, names, rows = [], [], []
    for each in truth.record.objects:
        seen = picture.views[each.name]
        if seen.visible_share < least or seen.visible_px < LEAST_PX:
            continue
        twin, mask = asked.twin(each.twin_id), picture.ids == truth.ids[each.name]
        model = asked.models[each.twin_id]
        location = locate_in_view(view, mask, model, seed=seed)
        row: dict[str, Any] = {"scene": truth.record.scene_id, "thing": each.name, "category": each.category}
        row |= {"share": seen.visible_share, "status": location.status, "right": None}
        if location.poses:
            true = world_to_camera @ object_pose(each)
            apart = pose_distances_m(model, location.poses[0].object_to_camera[None], true)[0] / model.diameter_m
            row["right"] = bool(apart < RIGHT)
            things.append((ViewedObject(mask, location, model, ()), twin))
            names.append(len(rows))
        rows.append(row)
    if not things:
        return rows
    place = LocatedView(view, things, inverse(world_to_camera), asked.robot.name, seed)
    scene = place.scene
    for number, row_number in enumerate(names):
        row, carried = rows[row_number], place.grasps(number)
        row["free"] = 0 if carried is None else len(carried.grasps)
        reached = [] if carried is None else [grasp.grasp_id for grasp in carried.grasps if grasp.reached]
        row["reached"] = len(reached)
        if not reached:
            row["outcome"] = "no_grasp"
        elif not isinstance(scene, LocatedScene) or (at := scene.place_of(things[number][0])) is None:
            row["outcome"] = "does_not_stay"
        else:
            row["outcome"] = tried(asked, truth, scene, at, row["thing"], reached, seed)
    return rows


def tried(
    asked: Asked, truth: SceneTruth, scene: LocatedScene, number: int, name: str, reached: list[str], seed: int
) -> str:
    """Plan in the estimated layout, execute in the true scene, and return the outcome."""
    assert scene.furniture is not None
    believed = [
        replace(each.placed, object_to_world=pose) for each, pose in zip(scene.objects, scene.rest, strict=True)
    ]
    target = believed[number]
    twin = scene.objects[number].twin
    area = PlacingArea(asked.robot.workspace, scene.furniture.supports[0])
    goal = free_goal(believed, number, area, np.random.default_rng([seed, truth.record.number, number]))
    if goal is None:
        return "no_room"
    usable = {each.grasp.grasp_id: each.grasp for each in usable_grasps(twin, asked.robot.gripper)}
    problem = PickPlaceProblem(
        target=target,
        goal_object_to_world=goal,
        grasps=tuple(usable[each] for each in reached),
        obstacles=tuple(each for place, each in enumerate(believed) if place != number),
        static_boxes=tuple(furniture_boxes(scene.furniture)),
        seed=seed,
    )
    true = [
        PlacedObject(each.name, each.twin_id, asked.twin(each.twin_id).rigid_body(), object_pose(each))
        for each in truth.record.objects
    ]
    place = next(i for i, each in enumerate(true) if each.name == name)
    moved = goal @ inverse(target.object_to_world)
    actual = PickPlaceProblem(
        target=true[place],
        goal_object_to_world=moved @ true[place].object_to_world,
        grasps=(),
        obstacles=tuple(each for i, each in enumerate(true) if i != place),
        static_boxes=tuple(furniture_boxes(truth.record.furniture)),
        seed=seed,
    )
    facts, closing = EpisodeFacts(), closing_of(asked.robot, asked.settings)
    with create_world(actual, asked.robot, asked.settings, closing.force_n) as world:
        start = settle_start(actual, asked.planner, asked.settings, None, world)
        if start is None:
            return "unsettled"
        course = AsPlanned(EpisodeStart(problem, tuple(believed), asked.planner, asked.settings, None), facts)
        if not course.plan():
            return "not_planned"
        execution = Execution(world, asked.robot, closing, *tip_poses_of(asked.planner))
        try:
            course.execute(execution)
            judge(start, moved @ start.problem.target.object_to_world, facts, world, execution)
        except EpisodeEnded as end:
            facts.outcome = str(end)
        del execution, course
    return facts.outcome


def main() -> None:
    """Try the objects of rendered scenes with their estimated poses."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("scenes", type=Path, nargs="+")
    parser.add_argument("--robot", default="panda")
    parser.add_argument("--most", type=int, default=60, help="scenes")
    parser.add_argument("--least", type=float, default=0.3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args()
    asked, rows, before = Asked(given.dataset, given.robot), list[dict[str, Any]](), time.process_time()
    files = [file for scenes in given.scenes for file in sorted(scenes.glob("scenes/*/*/scene.json"))][: given.most]
    for camera, file in enumerate(files):
        rows += rows_of(asked, read_scene_truth(file), camera, given.least, given.seed)
    found = [row for row in rows if row["right"] is not None]
    graspable = [row for row in found if row["reached"]]
    kept = sum(row["outcome"] == "kept" for row in graspable)
    print(
        f"{len(files)} scenes, {len(rows)} things, {len(found)} found, {sum(bool(row['right']) for row in found)} of these right"
    )
    print(
        f"{len(graspable)} with a free grasp that {given.robot} reaches; kept {kept} = {kept / max(1, len(graspable)):.1%}"
    )
    print("outcomes:", dict(Counter(row["outcome"] for row in graspable).most_common()))
    print("of those located right:", dict(Counter(row["outcome"] for row in graspable if row["right"]).most_common()))
    print(f"{(time.process_time() - before) / max(1, len(rows)):.2f} CPU-s a thing")
    if given.out:
        given.out.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
