"""Reachability of a located object's grasps by a robot's arm at its base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Grasp, PickPlaceProblem
from manitwin.episodes.target_grasps import usable_grasps
from manitwin.geometry.poses import inverse
from manitwin.scenes.loaded_scene import furniture_boxes
from manitwin.scenes.locate.located_objects import LocatedObject
from manitwin.scenes.locate.transferred_grasps import TransferredGrasps
from manitwin.scenes.locate.world_frame import WorldFrame
from manitwin.scenes.scene import Furniture


def with_reach(
    carried: TransferredGrasps,
    number: int,
    objects: Sequence[LocatedObject],
    furniture: Furniture,
    world: WorldFrame,
    planner: PickPlacePlanner,
) -> TransferredGrasps:
    """Return the free grasps of ``objects[number]`` with their reachability, reachable ones first.

    A grasp is reachable if the arm can take it without collision with table, boxes, other located objects and the object
    itself, at the end of a straight approach of 10 cm, as given or with the fingers exchanged. A grasp too wide for the
    robot's jaws is not reachable.
    """
    robot, target = planner.robot, objects[number]
    verified = target.twin.grasps()
    rows = {grasp_id: row for row, grasp_id in enumerate(verified.columns["grasp_id"])}
    usable = {each.grasp.grasp_id: each.grasp for each in usable_grasps(target.twin, robot.gripper)}
    known = [each for each in carried.grasps if each.grasp_id in usable and each.grasp_id in rows]
    to_object = inverse(target.seen)
    grasps = []
    for each in known:
        own = usable[each.grasp_id]
        to_own_tips = inverse(verified.gripper_to_object[rows[each.grasp_id]]) @ own.gripper_to_object
        pose = to_object @ world.camera_to_world @ each.gripper_to_camera @ to_own_tips
        grasps.append(Grasp(own.grasp_id, pose, own.width_m, own.joints_rad))
    problem = PickPlaceProblem(
        target=replace(target.placed, object_to_world=target.seen),
        goal_object_to_world=np.array(target.seen),
        grasps=tuple(grasps),
        obstacles=tuple(each.placed for place, each in enumerate(objects) if place != number),
        static_boxes=tuple(furniture_boxes(furniture)),
    )
    told = dict(zip((each.grasp_id for each in known), planner.reachable_grasps(problem), strict=True))
    found = [replace(each, reached=told.get(each.grasp_id, False)) for each in carried.grasps]
    found.sort(key=lambda each: not each.reached)
    return replace(carried, grasps=tuple(found), robot=robot.name)
