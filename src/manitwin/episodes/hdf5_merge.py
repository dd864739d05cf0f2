"""Merging of episode files into one, with the JSON file of ManiSkill's format."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

import h5py

from manitwin.episodes.attempts import attempt_from
from manitwin.episodes.hdf5_file import LIBVER, EpisodeFile
from manitwin.episodes.recording import RATE_HZ
from manitwin.errors import EpisodesError
from manitwin.twin.store import atomic_file

TRAJECTORIES, METADATA = "trajectory.h5", "trajectory.json"

ENVIRONMENT = "manitwin/PickPlace"
"""The ``env_id``, which is not a ManiSkill environment: states can be set and read there, but the task cannot be created."""

CONTROL_MODE = "pd_joint_pos"
"""ManiSkill's name for joint position targets; here in radians and metres, not scaled to [-1, 1]."""


def merge_episodes(files: Iterable[Path], folder: Path) -> int:
    """Write ``trajectory.h5`` and ``trajectory.json`` of all episodes of all files in order; return their number.

    Groups are copied unchanged and numbered consecutively; one episode's metadata is in memory at a time. Each file is
    written atomically, the JSON last. Raises EpisodesError for a file that cannot be read.
    """
    count, longest, robots = 0, 0, dict[str, Any]()
    with atomic_file(folder / METADATA) as metadata, metadata.open("w", encoding="ascii", newline="\n") as text:
        with (
            atomic_file(folder / TRAJECTORIES) as merged,
            h5py.File(merged, "w", libver=LIBVER) as target,
            _listed(text, "episodes") as write,
        ):
            for path in files:
                with EpisodeFile(path) as source:
                    for number in range(len(source)):
                        said, group = source.metadata(number), source.content.group(f"traj_{number}")
                        steps = source.content.length(f"traj_{number}/actions")
                        group.file.copy(group, target, name=f"traj_{count}")
                        write(_row(count, steps, said))
                        _note(robots, said["robot"], path)
                        longest, count = max(longest, steps), count + 1
        text.write(f',\n"env_info": {_line(_environment(robots, longest))},\n')
        text.write('"source_type": "motionplanning",\n"source_desc": "planned and simulated by manitwin"\n}\n')
    return count


def _row(number: int, steps: int, said: dict[str, Any]) -> dict[str, Any]:
    attempt = attempt_from(said["attempt"])
    return {
        "episode_id": number,
        "episode_seed": attempt.seed,
        "control_mode": CONTROL_MODE,
        "elapsed_steps": steps,
        "reset_kwargs": {"seed": attempt.seed, "options": {}},
        "success": attempt.succeeded,
        "fail": not attempt.succeeded,
        "robot": said["robot"]["name"],
        "objects": said["objects"],
        "target": said["target"],
        "attempt": said["attempt"],
        "facts": said["facts"],
    }


def _note(robots: dict[str, Any], robot: dict[str, Any], path: Path) -> None:
    """Keep each robot once; raises EpisodesError for two different robots with the same name."""
    if robots.setdefault(robot["name"], robot) != robot:
        raise EpisodesError(
            f"{path}: its robot {robot['name']!r} differs from the robot of this name in other files (its digest or"
            f" limits differ); give one of the two another name"
        )


def _environment(robots: dict[str, Any], longest: int) -> dict[str, Any]:
    settings = {"control_mode": CONTROL_MODE, "obs_mode": "state_dict", "control_freq": RATE_HZ, "robots": robots}
    return {"env_id": ENVIRONMENT, "env_kwargs": settings, "max_episode_steps": longest}


def _line(value: Any) -> str:
    return json.dumps(value, sort_keys=True, allow_nan=False)


@contextmanager
def _listed(text: TextIO, name: str) -> Iterator[Any]:
    """Open a JSON object that contains a list, one entry per line; the object stays open for further members."""
    text.write(f'{{\n"{name}": [')
    entries = 0

    def write(entry: Any) -> None:
        nonlocal entries
        text.write(f"{',' if entries else ''}\n{_line(entry)}")
        entries += 1

    yield write
    text.write("\n]")
