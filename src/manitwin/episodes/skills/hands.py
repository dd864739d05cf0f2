"""Which hands a skill can be done with: what uses a held thing, or the closed fingertips, is planned for two jaws."""

from __future__ import annotations

from manitwin.episodes.skills.handover import Handover
from manitwin.episodes.skills.held_skill import HeldSkill
from manitwin.episodes.skills.push import Push
from manitwin.episodes.skills.registry import PICK_PLACE, SKILLS
from manitwin.episodes.skills.skill import Skill
from manitwin.errors import UsageError
from manitwin.robots.load import load_robot, shipped_robots, shipped_two_arms
from manitwin.robots.robot import Robot


def wants_jaws(skill: Skill | None) -> bool:
    """Tell whether a skill (None: pick-and-place) is planned for two jaws alone."""
    return isinstance(skill, HeldSkill | Push | Handover)


def check_hand(robot: Robot, skill: Skill | None) -> None:
    """Raise UsageError where a robot's arms or hand are none for a skill, naming what would do."""
    if isinstance(skill, Handover) and not robot.arms:
        raise UsageError(
            f"skill {skill.name} wants two arms, {robot.name} has one; "
            f"give one of {', '.join(shipped_two_arms())}, or a .toml file of two arms"
        )
    if robot.arms and not isinstance(skill, Handover):
        raise UsageError(_of_one_arm(f"skill {PICK_PLACE if skill is None else skill.name} wants", robot))
    if robot.has_jaws or skill is None or not wants_jaws(skill):
        return
    others = ", ".join([PICK_PLACE, *(name for name, each in SKILLS.items() if not wants_jaws(each))])
    raise UsageError(
        f"skill {skill.name} wants a hand of two jaws, {robot.name} has {robot.gripper.name} ({robot.gripper.kind}); "
        f"give one of {_with_jaws()}, or with this robot one of the skills {others}"
    )


def check_jaws(robot: Robot, what: str) -> None:
    """Raise UsageError where a robot has no two jaws, which ``what`` is made for."""
    if robot.arms:
        raise UsageError(_of_one_arm(f"{what} want", robot))
    if not robot.has_jaws:
        raise UsageError(
            f"{what} want a hand of two jaws, {robot.name} has {robot.gripper.name} ({robot.gripper.kind}); "
            f"give one of {_with_jaws()}"
        )


def _of_one_arm(who_wants: str, robot: Robot) -> str:
    return f"{who_wants} one arm, {robot.name} has two, for the skill {Handover.name}; give one of {_with_jaws()}"


def _with_jaws() -> str:
    return ", ".join(name for name in shipped_robots() if load_robot(name).has_jaws)
