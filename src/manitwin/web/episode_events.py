"""Events of a recorded episode on its timeline: phases, goal literals, grasps, falling granules, contacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from manitwin.episodes.goals.goal import Literal
from manitwin.episodes.goals.goal_text import parse_goal
from manitwin.episodes.handled_objects import handled_objects, of_states
from manitwin.episodes.planning.problem import Phase
from manitwin.episodes.recording import RATE_HZ, Recording
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.errors import EpisodesError, UsageError
from manitwin.formats.printable import printable_line

HELD_N = 0.5
"""Minimum force of both fingers on a held object; also the contact threshold of the recording (``unplanned_contact``)."""
SHORT = 3
"""Number of states: shorter interruptions are bridged, and shorter spans are dropped."""
MOST_EVENTS = 200

_SHOWN = {
    "force_n": (1.0, "N"),
    "off_m": (1e3, "mm off"),
    "angle_rad": (180 / np.pi, "degrees off"),
    "speed_m_s": (1.0, "m/s"),
    "rise_m": (1e3, "mm of rise"),
}
"""Measured values of events that are displayed: factor and unit."""


@dataclass(frozen=True)
class Span:
    """An interval of recorded states, both ends included, with a label."""

    first: int
    last: int
    label: str


@dataclass(frozen=True)
class TimelineEvent:
    """An event at a time of the recording in seconds."""

    time_s: float
    kind: str
    label: str


class _Event(BaseModel):
    model_config = ConfigDict(extra="ignore")

    kind: str = Field(max_length=64)
    subject: str = Field(max_length=256)
    second: str | None = Field(default=None, max_length=256)
    values: dict[str, FiniteFloat] = Field(default={}, max_length=32)


class _Events(BaseModel):
    model_config = ConfigDict(extra="ignore")

    events: list[_Event] = Field(default=[], max_length=MOST_EVENTS)


def phases(recording: Recording) -> list[Span]:
    """Return the phases in order; the state after the last action belongs to the last phase."""
    known = {int(each): each.name.lower() for each in Phase}
    return [
        Span(first, last, known.get(value, f"phase {value}"))
        for first, last, value in _runs(of_states(recording.phase))
    ]


def literals(episode: StoredEpisode) -> list[Span]:
    """Return the intervals in which each literal of the goal is pursued; empty without a goal expression."""
    said = goal_literals(episode.attempt.goal)
    recording = episode.recording
    if not said:
        return []
    if recording.active_literal is None:
        return [Span(0, recording.steps, " and ".join(said))]
    return [
        Span(first, last, said[value] if value < len(said) else f"literal {value + 1}")
        for first, last, value in _runs(of_states(recording.active_literal))
    ]


def goal_literals(goal: str | None) -> list[str]:
    """Return the literals of a goal expression, the whole text if it cannot be parsed, or nothing without a goal."""
    found = [str(each) for each in _parse_literals(goal)]
    return found or ([printable_line(goal, max_characters=400)] if goal else [])


def _parse_literals(goal: str | None) -> tuple[Literal, ...]:
    if not goal:
        return ()
    try:
        return parse_goal(goal).literals
    except UsageError:
        return ()


def timeline_events(episode: StoredEpisode, called: Callable[[str], str]) -> list[TimelineEvent]:
    """Return the events in order of time; ``called`` maps object names to display names.

    Raises EpisodesError if the recorded events are invalid.
    """
    recording, moved = episode.recording, [called(episode.objects[number].name) for number in handled_objects(episode)]
    rate, last = float(RATE_HZ), recording.steps
    found: list[TimelineEvent] = []
    for number, forces_n in enumerate(np.split(recording.finger_forces_n, episode.robot.arm_count, axis=1)):
        by = f" by the {episode.robot.arms[number].name}" if episode.robot.arms else ""
        for first, end in _long_true_spans(forces_n.min(axis=1) > HELD_N):
            found.append(TimelineEvent(first / rate, "grasped", f"grasped {moved[first]}{by}"))
            if end < last:
                found.append(TimelineEvent((end + 1) / rate, "released", f"released {moved[first]}{by}"))
    for first, end in _long_true_spans(~recording.target_on_support.astype(bool)):
        if first:
            found.append(TimelineEvent(first / rate, "lifted", f"{moved[first]} leaves its support"))
        if end < last:
            found.append(TimelineEvent((end + 1) / rate, "set_down", f"{moved[first]} rests on a support"))
    for first, _ in _spans(recording.unplanned_contact.astype(bool)):
        found.append(TimelineEvent(first / rate, "contact", "the robot touched what it should not"))
    found += _granules(episode, called) + _recorded_events(episode, called)
    found += [
        TimelineEvent(span.first / rate, "literal", f"now: {span.label}") for span in literals(episode)[1:]
    ]  # the first literal begins with the episode
    return sorted(found, key=lambda each: each.time_s)[:MOST_EVENTS]


def _granules(episode: StoredEpisode, called: Callable[[str], str]) -> list[TimelineEvent]:
    counts = episode.recording.granules_in_objects
    if counts is None:
        return []
    found = []
    for column, thing in enumerate(episode.objects):
        held = counts[:, column].astype(int)
        more = np.flatnonzero(np.diff(held) > 0) + 1
        if len(more) and held.max() > held[0]:
            first, peak = int(more[0]), int(np.argmax(held))
            found.append(TimelineEvent(first / RATE_HZ, "poured", f"the first granule in {called(thing.name)}"))
            if peak > first:
                said = f"{int(held[peak])} granules in {called(thing.name)}"
                found.append(TimelineEvent(peak / RATE_HZ, "poured", said))
    return found


def _recorded_events(episode: StoredEpisode, called: Callable[[str], str]) -> list[TimelineEvent]:
    """Return the events recorded during the episode; those without a time are placed at its end."""
    try:
        events = _Events.model_validate(episode.facts).events
    except ValidationError as error:
        first = error.errors()[0]
        where = printable_line(".".join(map(str, first["loc"])), max_characters=80)
        raise EpisodesError(f"facts: {where}: {first['msg']}; write the episodes again") from error
    end_s = episode.recording.steps / RATE_HZ
    found = []
    for event in events:
        second = f", {called(event.second)}" if event.second else ""
        values = ", ".join(
            f"{event.values[name] * factor:.1f} {words}"
            for name, (factor, words) in _SHOWN.items()
            if name in event.values
        )
        label = f"{event.kind.replace('_', ' ')} {called(event.subject)}{second}{f' ({values})' if values else ''}"
        time_s = min(max(event.values.get("time_s", end_s), 0.0), end_s)
        found.append(TimelineEvent(time_s, "told", label))
    return found


def _runs(values: np.ndarray) -> list[tuple[int, int, int]]:
    """Return the first index, last index and value of each run of equal values."""
    starts = np.flatnonzero(np.diff(values.astype(int), prepend=-1))
    ends = [*(starts[1:] - 1), len(values) - 1]
    return [(int(start), int(end), int(values[start])) for start, end in zip(starts, ends, strict=True)]


def _spans(true: np.ndarray) -> list[tuple[int, int]]:
    """Return the intervals in which a flag is true, as first and last index; gaps up to ``SHORT`` are closed."""
    found: list[tuple[int, int]] = []
    for start, end, value in _runs(true):
        if not value:
            continue
        if found and start - found[-1][1] <= SHORT:
            found[-1] = (found[-1][0], end)
        else:
            found.append((start, end))
    return found


def _long_true_spans(true: np.ndarray) -> list[tuple[int, int]]:
    """Return the intervals that are not short: an object that tips for an instant has not been lifted."""
    return [(start, end) for start, end in _spans(true) if end - start + 1 >= SHORT]


def span_json(span: Span) -> dict[str, Any]:
    """Return an interval as plain values in seconds."""
    return {"from_s": span.first / RATE_HZ, "to_s": span.last / RATE_HZ, "label": span.label}
