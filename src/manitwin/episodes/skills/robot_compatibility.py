"""Compatibility of robots and skills: skills that use a held object or closed fingertips are planned for parallel jaws."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from manitwin.episodes.skills.handover import Handover
from manitwin.episodes.skills.held_skill import HeldSkill
from manitwin.episodes.skills.press import Press
from manitwin.episodes.skills.push import Push
from manitwin.episodes.skills.registry import PICK_PLACE, SKILLS
from manitwin.episodes.skills.skill import Skill
from manitwin.errors import UsageError
from manitwin.robots.load import load_robot, shipped_robots, shipped_two_arms
from manitwin.robots.robot import Robot


def requires_jaws(skill: Skill | None) -> bool:
    """Tell whether a skill (None: pick-and-place) is planned for parallel jaws only."""
    return isinstance(skill, HeldSkill | Push | Handover)


def skills_of(robot: Robot) -> tuple[Skill, ...]:
    """Return the skills that a robot's arms and hand support; the first of two arms does single-arm skills."""
    return tuple(skill for skill in SKILLS.values() if _has_arms(robot, skill) and _has_hand(robot, skill))


def check_hand(robot: Robot, skill: Skill | None) -> None:
    """Raise UsageError, naming alternatives, if a robot's arms or hand do not support a skill."""
    if skill is not None and not _has_arms(robot, skill):
        raise UsageError(
            f"skill {skill.name} needs two arms, but {robot.name} has one; give one of"
            f" {', '.join(shipped_two_arms())}, or a .toml file of two arms"
        )
    if skill is None or _has_hand(robot, skill):
        return
    others = ", ".join([PICK_PLACE, *(each.name for each in skills_of(robot))])
    raise UsageError(
        f"skill {skill.name} needs a two-jaw gripper, but {robot.name} has {robot.gripper.name}"
        f" ({robot.gripper.kind}); "
        f"give one of {_with_jaws()}, or with this robot one of the skills {others}"
    )


def check_grasps(robot: Robot, skill: Skill | None, twin_ids: Sequence[str], has_grasps: Callable[[str], bool]) -> None:
    """Raise UsageError if none of the twins has a grasp for the robot's hand, because every attempt would fail.

    ``has_grasps`` tells whether a twin, by its id, has one. Skills of the closed hand need none.
    """
    if isinstance(skill, Press | Push) or not twin_ids or any(has_grasps(twin_id) for twin_id in twin_ids):
        return
    hand = robot.gripper.name
    raise UsageError(
        f"none of {len(twin_ids)} twins has a verified grasp for {hand}, the hand of {robot.name}; build the twins"
        f" for it too (manitwin build --gripper {hand}, or its .toml file: docs/grippers.md), or give a robot with"
        f" another hand"
    )


def check_jaws(robot: Robot, what: str) -> None:
    """Raise UsageError unless a robot has one arm with parallel jaws, which ``what`` requires."""
    if robot.arms:
        raise UsageError(f"{what} need one arm, but {robot.name} has two; give one of {_with_jaws()}")
    if not robot.has_jaws:
        raise UsageError(
            f"{what} need a two-jaw gripper, but {robot.name} has {robot.gripper.name} ({robot.gripper.kind}); "
            f"give one of {_with_jaws()}"
        )


def _has_arms(robot: Robot, skill: Skill) -> bool:
    return skill.arms <= max(1, len(robot.arms))


def _has_hand(robot: Robot, skill: Skill) -> bool:
    return robot.has_jaws or not requires_jaws(skill)


def _with_jaws() -> str:
    return ", ".join(name for name in shipped_robots() if load_robot(name).has_jaws)
