"""JSON document of a recorded episode for the 3D view: poses of links and objects over time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from manitwin.episodes.episode_room import EpisodeRoom, episode_room, granules_of
from manitwin.episodes.recording import RATE_HZ, Recording
from manitwin.episodes.replay_pictures import link_poses
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.errors import EpisodesError, ManiTwinError
from manitwin.formats.printable import printable_line
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.robots.robot import Robot
from manitwin.web.episode_events import literals, phases, span_json, timeline_events
from manitwin.web.episode_folders import EpisodeFolders
from manitwin.web.links import Links
from manitwin.web.robot_model import links_with_visuals
from manitwin.web.scene_document import furniture_boxes
from manitwin.web.served_files import MODEL

DOCUMENT = "episode_view.json"
MOST_STATES = 1_500
"""Maximum number of states of a document: 75 s at the recorded rate; longer episodes are subsampled."""
MOST_NUMBERS = 600_000
"""Maximum number of values of all poses together: 4 MB of JSON."""
MOST_OBJECTS, MOST_GRANULES = 200, 300
_DECIMALS = 4
"""A tenth of a millimetre; for quaternions a hundredth of a degree."""
_LONGEST_QUATERNION = 0.01
"""Tolerance of the norm of a recorded quaternion."""
_LENGTH_OF_POSE = 7


def episode_document(episode: StoredEpisode, number: int, folders: EpisodeFolders, links: Links) -> dict[str, Any]:
    """Return the document: metres, world frame, quaternions wxyz, seconds. ``unreadable`` lists what cannot be shown.

    ``robots`` has the robot, or each of two arms. Poses are rows of position and quaternion, one per entry of ``time_s``, or a
    single row if constant. Forces are maxima since the previous row. Raises EpisodesError for invalid rotations and for episodes
    that exceed the limits.
    """
    recording, unreadable = episode.recording, list[str]()
    if len(episode.objects) > MOST_OBJECTS:
        raise EpisodesError(f"{len(episode.objects)} objects are more than the {MOST_OBJECTS} that are shown")
    try:
        found = folders.robot_of(episode.robot)
        shown = [links_with_visuals(arm.urdf) for arm in found.arms or (found,)]
        robot: Robot | None = found
    except ManiTwinError as error:
        robot, shown = None, []
        unreadable.append(str(error))
    objects, called = _objects(episode, folders, links, unreadable)
    states = sampled_states(recording, sum(map(len, shown)) + len(episode.objects) + episode.robot.arm_count)
    return {
        "episode_id": episode.attempt.episode_id,
        "number": number,
        "time_s": [round(float(state) / RATE_HZ, _DECIMALS) for state in states],
        "rate_hz": RATE_HZ,
        "robots": [] if robot is None else _arms(robot, shown, recording, states, links),
        "objects": [
            {**each, "poses": poses} for each, poses in zip(objects, _object_poses(recording, states), strict=True)
        ],
        "target": recording.target,
        "tips": _tips(recording, states),
        "granules": _granules(episode, states, unreadable),
        **_room_description(episode, unreadable),
        "goal": _goal(episode),
        "hands": _hands(episode, states),
        "sides": _force_labels(episode),
        "forces_n": [
            [round(float(each), 2) for each in side] for side in _interval_maxima(recording.finger_forces_n, states).T
        ],
        "phases": [span_json(each) for each in phases(recording)],
        "literals": [span_json(each) for each in literals(episode)],
        "happenings": [
            {"time_s": each.time_s, "kind": each.kind, "label": printable_line(each.label, max_characters=200)}
            for each in timeline_events(episode, called)
        ],
        "unreadable": [*unreadable, *([folders.without_twins] if folders.without_twins else [])],
    }


def sampled_states(recording: Recording, things: int) -> np.ndarray:
    """Return the indices of the states in a document: all, or every n-th and the last, within its limits.

    ``things`` is the number of poses per state.
    """
    count = recording.steps + 1
    granules = (
        0 if recording.granule_positions_m is None else min(recording.granule_positions_m.shape[1], MOST_GRANULES)
    )
    numbers = _LENGTH_OF_POSE * things + 3 * granules
    most = min(MOST_STATES, MOST_NUMBERS // numbers)
    step = -(-count // max(1, most))
    return np.unique(np.append(np.arange(0, count, step), count - 1))


def _objects(
    episode: StoredEpisode, folders: EpisodeFolders, links: Links, unreadable: list[str]
) -> tuple[list[dict[str, Any]], Callable[[str], str]]:
    """Return the description of each object without its poses, and a function from object names to display names."""
    known: dict[str, tuple[str, str]] = {}
    twins = folders.twins
    for twin_id in sorted({each.twin_id for each in episode.objects}):
        if twins is None:
            break
        try:
            record = twins.twin(twin_id).record
        except ManiTwinError as error:
            unreadable.append(str(error))
            continue
        category = record.language.category if record.language is not None else ""
        known[twin_id] = (category, links.file(twin_id, MODEL, record.revision))
    words = {
        each.name: f"{each.name} ({known[each.twin_id][0]})" if known.get(each.twin_id, ("",))[0] else each.name
        for each in episode.objects
    }
    told = [
        {
            "name": each.name,
            "twin_id": each.twin_id,
            "label": printable_line(words[each.name], max_characters=200),
            "model": known[each.twin_id][1] if each.twin_id in known else None,
        }
        for each in episode.objects
    ]
    return told, lambda name: words.get(name, name.replace("_", " "))


def _arms(
    robot: Robot, shown: list[list[str]], recording: Recording, states: np.ndarray, links: Links
) -> list[dict[str, Any]]:
    """Return the links of the robot, or of each of its two arms, whose values are adjacent columns of the arrays."""
    arms = robot.arms or (robot,)
    ends = np.cumsum([len(arm.arm_joints) for arm in arms])[:-1]
    joints = np.split(recording.joint_positions_rad[states], ends, axis=1)
    hands = np.split(recording.hand[states], len(arms), axis=1)
    told = []
    for number, (arm, names) in enumerate(zip(arms, shown, strict=True)):
        rows = [link_poses(arm, *row) for row in zip(joints[number], hands[number], strict=True)]
        of_links = []
        for name in names:
            poses = np.array([row[name] for row in rows])
            of_links.append({"name": name, "poses": _poses(poses[:, :3, 3], quaternion_wxyz(poses[:, :3, :3]))})
        told.append({"name": arm.name, "model": links.robot(robot.name, number), "links": of_links})
    return told


def _tips(recording: Recording, states: np.ndarray) -> list[list[float]]:
    positions = recording.tip_position_m[states].reshape(len(states), -1, 3)
    quaternions = recording.tip_quaternion_wxyz[states].reshape(len(states), -1, 4)
    return [_poses(positions[:, number], quaternions[:, number]) for number in range(positions.shape[1])]


def _object_poses(recording: Recording, states: np.ndarray) -> list[list[float]]:
    positions, quaternions = recording.object_positions_m[states], recording.object_quaternions_wxyz[states]
    return [_poses(positions[:, i], quaternions[:, i]) for i in range(positions.shape[1])]


def _poses(positions_m: np.ndarray, quaternions_wxyz: np.ndarray) -> list[float]:
    """Return pose rows ``(S, 7)`` as one flat list; a single row if all are equal after rounding."""
    lengths = np.linalg.norm(quaternions_wxyz.astype(float), axis=1)
    if not (np.abs(lengths - 1) < _LONGEST_QUATERNION).all():
        raise EpisodesError("a recorded rotation is none: its quaternion is not of length 1; write the episodes again")
    rows = np.round(np.hstack([positions_m, quaternions_wxyz]).astype(float), _DECIMALS)
    return _rounded_list(rows[:1] if (rows == rows[0]).all() else rows)


def _rounded_list(values: np.ndarray) -> list[float]:
    return [float(each) for each in np.round(np.asarray(values, float), _DECIMALS).ravel()]


def _granules(episode: StoredEpisode, states: np.ndarray, unreadable: list[str]) -> dict[str, Any] | None:
    try:
        found = granules_of(episode)
    except EpisodesError as error:
        unreadable.append(str(error))
        return None
    positions = episode.recording.granule_positions_m
    if found is None or positions is None:
        return None
    chosen = np.arange(0, found[0], max(1, -(-found[0] // MOST_GRANULES)))
    return {"radius_m": found[1], "count": len(chosen), "positions_m": _rounded_list(positions[states][:, chosen])}


def _room_description(episode: StoredEpisode, unreadable: list[str]) -> dict[str, Any]:
    try:
        room: EpisodeRoom = episode_room(episode)
    except EpisodesError as error:
        unreadable.append(str(error))
        return {"furniture": [], "fixtures": []}
    fixtures = [
        {
            "name": box.name,
            "half_extents_m": list(box.half_extents_m),
            "poses": [*box.position_m, *box.quaternion_wxyz],
        }
        for fixture in room.fixtures
        for box in fixture.boxes
    ]
    return {"furniture": furniture_boxes(room.furniture), "fixtures": fixtures}


def _goal(episode: StoredEpisode) -> list[float] | None:
    """Return the goal pose of the target for episodes without a goal expression; None otherwise."""
    said = episode.facts.get("goal_object_to_world")
    if episode.attempt.goal is not None or said is None:
        return None
    try:
        pose = np.array(said, float)
    except (TypeError, ValueError):
        return None
    if (
        pose.shape != (4, 4)
        or not np.isfinite(pose).all()
        or abs(np.linalg.det(pose[:3, :3]) - 1) > _LONGEST_QUATERNION
    ):
        return None
    return _rounded_list(np.append(pose[:3, 3], quaternion_wxyz(pose[:3, :3])))


def _hands(episode: StoredEpisode, states: np.ndarray) -> list[dict[str, Any]]:
    """Return the jaw opening (m) of each arm; for other hands the only joint, or the mean of the joints (rad), by name."""
    names, values = episode.robot.hand_state, episode.recording.hand[states]
    called = [f"{arm.name}: opening" for arm in episode.robot.arms] or ["opening"]
    if episode.robot.has_jaws and len(called) == values.shape[1]:
        return [
            {"name": name, "is_opening": True, "values": _rounded_list(values[:, place])}
            for place, name in enumerate(called)
        ]
    name = names[0] if len(names) == 1 else "mean of the hand's joints, rad"
    return [{"name": name, "is_opening": False, "values": _rounded_list(values.mean(axis=1))}]


def _force_labels(episode: StoredEpisode) -> list[str]:
    """Return the label of each force curve."""
    words = ("force on the object, N", "from the other side")
    return [f"{arm.name}: {each}" for arm in episode.robot.arms for each in words] or list(words)


def _interval_maxima(values: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return, for each of the given states, the maximum of ``values (T + 1, F)`` since the previous one."""
    starts = np.append(0, states[:-1] + 1)
    return np.asarray(np.maximum.reduceat(values, starts, axis=0))
