"""Handled object in each state of an episode, which changes for goals of several literals."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.goals.goal_text import parse_goal
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.errors import UsageError


def handled_objects(episode: StoredEpisode) -> np.ndarray:
    """Return the number of the handled object ``(T + 1,) int``: the subject of the literal being worked on.

    Contacts are recorded for this object. For a single literal, or if none names an object, it is the recording's target.
    """
    recording = episode.recording
    target, worked_on = recording.target, recording.active_literal
    if worked_on is None:
        return np.full(recording.steps + 1, target)
    numbers = {each.name: number for number, each in enumerate(episode.objects)}
    subjects = np.array([numbers.get(name, target) for name in _subjects(episode.attempt.goal)] or [target])
    literals = of_states(worked_on).astype(int)
    return np.where(literals < len(subjects), subjects[np.minimum(literals, len(subjects) - 1)], target)


def of_states(of_actions: np.ndarray) -> np.ndarray:
    """Return per-action values ``(T,)`` as per-state values ``(T + 1,)``: that of the following action, or the last one."""
    return np.append(of_actions, of_actions[-1:])


def _subjects(goal: str | None) -> list[str]:
    if not goal:
        return []
    try:
        return [each.subject for each in parse_goal(goal).literals]
    except UsageError:
        return []
