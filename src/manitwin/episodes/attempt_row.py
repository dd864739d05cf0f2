"""Conversion of an episode's facts into a row of the table of attempts."""

from __future__ import annotations

import json

from manitwin.episodes.attempts import Attempt
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.target_grasps import TargetGrasp
from manitwin.robots.robot import Robot


def attempt_row(
    episode_id: str,
    robot: Robot,
    skill: str,
    twin_id: str,
    category: str,
    scene_id: str | None,
    seed: int,
    others: int,
    facts: EpisodeFacts,
    grasp: TargetGrasp | None = None,
    instructions: tuple[str, ...] = (),
    task_id: str | None = None,
) -> Attempt:
    """Return the row of an episode, from its inputs and its facts."""
    errors, judged = facts.errors, facts.evaluation
    return Attempt(
        episode_id=episode_id,
        robot=robot.name,
        skill=skill,
        twin_id=twin_id,
        category=category,
        scene_id=scene_id,
        seed=seed,
        others=others,
        outcome=facts.outcome,
        grasp_id=grasp.grasp.grasp_id if grasp else None,
        grasp_type=grasp.grasp_type if grasp else None,
        transferred=grasp.transferred if grasp else False,
        grasps_tried=facts.grasps_tried,
        plan_failures=json.dumps(dict(sorted(facts.plan_failures.items()))),
        position_error_m=errors.position_error_m if errors else None,
        tilt_rad=errors.tilt_rad if errors else None,
        yaw_error_rad=errors.yaw_error_rad if errors else None,
        slip_m=facts.slip_m,
        length_s=facts.length_s,
        instructions=instructions,
        goal=str(judged.goal) if judged else None,
        failure=judged.failure if judged else None,
        measured=json.dumps(judged.to_json()) if judged else None,
        task_id=task_id,
    )
