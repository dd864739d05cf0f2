"""Registry of the skills by name."""

from __future__ import annotations

from collections.abc import Mapping

from manitwin.episodes.skills.aim import Aim
from manitwin.episodes.skills.away_from import AwayFrom
from manitwin.episodes.skills.beside import SIDE_SKILLS
from manitwin.episodes.skills.cut_motion import CutMotion
from manitwin.episodes.skills.handover import Handover
from manitwin.episodes.skills.hang import Hang
from manitwin.episodes.skills.insert import Insert
from manitwin.episodes.skills.lift import Lift
from manitwin.episodes.skills.place_in import PlaceIn
from manitwin.episodes.skills.place_on import PLACE_ON, STACK
from manitwin.episodes.skills.pour import Pour
from manitwin.episodes.skills.press import Press
from manitwin.episodes.skills.push import Push
from manitwin.episodes.skills.skill import Skill
from manitwin.episodes.skills.stir import Stir
from manitwin.episodes.skills.strike import Strike
from manitwin.episodes.skills.upright import Upright
from manitwin.episodes.skills.wipe import Wipe
from manitwin.errors import UsageError, unknown_name_message

PICK_PLACE = "pick_place"
"""Moves an object to a random pose: its goal is that pose, not a literal."""

_SKILLS: tuple[Skill, ...] = (
    PLACE_ON,
    PlaceIn(),
    STACK,
    *SIDE_SKILLS,
    AwayFrom(),
    Upright(),
    Lift(),
    Hang(),
    Insert(),
    Press(),
    Strike(),
    Pour(),
    Push(),
    Stir(),
    Wipe(),
    CutMotion(),
    Aim(),
    Handover(),
)

SKILLS: Mapping[str, Skill] = {skill.name: skill for skill in _SKILLS}


def skill_names() -> tuple[str, ...]:
    """Return the names of all skills, pick-and-place first."""
    return (PICK_PLACE, *SKILLS)


def load_skill(name: str) -> Skill | None:
    """Return a skill, None for pick-and-place; raises UsageError listing the valid names for an unknown one."""
    if name == PICK_PLACE:
        return None
    if name not in SKILLS:
        raise UsageError(unknown_name_message("skill", name, skill_names()))
    return SKILLS[name]
