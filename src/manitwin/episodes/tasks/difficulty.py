"""Difficulty score of a task, by counting its difficult aspects."""

from __future__ import annotations

from manitwin.episodes.pick_place_tasks import footprint_at
from manitwin.episodes.tasks.feasibility_check import PlannedTask
from manitwin.episodes.tasks.task_record import TaskDifficulty
from manitwin.episodes.tasks.task_scene import TaskScene
from manitwin.geometry.boxes import separation_m, smallest_enclosing_circle

CLOSE_M = 0.05  # a closer neighbour leaves little room for fingers
TIGHT_M = 0.01  # clearance between an inserted object and the rim
MANY_GRASPS = 10


def difficulty_of(scene: TaskScene, planned: PlannedTask) -> TaskDifficulty:
    """Return the counts of literals, functional frames, close neighbours and tight fits, and whether many grasps were tried."""
    steps, goals = planned.sequence.steps, [step.goal for step in planned.sequence.steps]
    parts = {
        "literals": len(steps),
        "functional_frames": sum(goal.has_path for goal in goals),
        "close_neighbours": sum(_is_close(scene, action.target) for action in planned.candidate.actions),
        "tight_fits": sum(
            not goal.has_path and action.partner is not None and _is_tight(scene, action.target, action.partner)
            for goal, action in zip(goals, planned.candidate.actions, strict=True)
            if action.goal.literals[0].second in goal.openings
        ),
        "hard_to_plan": int(planned.grasps_tried > MANY_GRASPS),
    }
    return TaskDifficulty(score=sum(parts.values()), **parts)


def _is_close(scene: TaskScene, target: int) -> bool:
    corners = [footprint_at(each.body, each.object_to_world) for each in scene.objects]
    return any(separation_m(corners[target], each) < CLOSE_M for place, each in enumerate(corners) if place != target)


def _is_tight(scene: TaskScene, target: int, partner: int) -> bool:
    """Tell whether a vessel's rim leaves less than 1 cm around an object in its current orientation."""
    opening = scene.pool.body(scene.objects[partner].twin_id).opening
    placed = scene.objects[target]
    radius_m = smallest_enclosing_circle(footprint_at(placed.body, placed.object_to_world))[1]
    return opening is not None and opening.rim_radius_m - float(radius_m) < TIGHT_M
