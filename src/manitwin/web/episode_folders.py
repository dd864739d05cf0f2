"""Numbered access to the recorded episodes of a run, with their twins and their robot."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from manitwin.engine.ledger.location import CONFIG
from manitwin.episodes.attempts import ATTEMPTS
from manitwin.episodes.batch import BATCHES
from manitwin.episodes.collect import MANISKILL, batch_folders
from manitwin.episodes.configuration import read_configuration
from manitwin.episodes.episodes_stage import EPISODES
from manitwin.episodes.hdf5_file import EpisodeFile
from manitwin.episodes.hdf5_merge import TRAJECTORIES
from manitwin.episodes.recording_arrays import checked_recording
from manitwin.episodes.stored_episode import RecordedRobot, StoredEpisode, recorded_robot
from manitwin.errors import ConfigError, EpisodesError, ManiTwinError, UsageError
from manitwin.formats.printable import printable_line
from manitwin.robots.load import load_robot, shipped_robots, shipped_two_arms
from manitwin.robots.robot import Robot
from manitwin.twin.loaded_twin import MOVED
from manitwin.web.attempt_rows import AttemptRows
from manitwin.web.served_files import TwinFolders

MOST_EPISODE_BYTES = 256 << 20
"""Limit on the unpacked arrays of one episode; a minute with 60 granules has 3 MB."""
_SUFFIXES = (".h5", ".hdf5")


@dataclass(frozen=True)
class _Place:
    """Location of an episode; ``problem`` is set if its file cannot be read, which then counts as one episode."""

    file: Path
    number: int
    problem: str | None = None


def has_episodes(place: str) -> bool:
    """Return whether a place holds recorded episodes: a run of ``manitwin trajectories``, or an HDF5 file."""
    if "://" in place:
        return False
    found = Path(place)
    if found.is_file():
        return found.suffix.lower() in _SUFFIXES
    return _merged(found) is not None or (found / BATCHES).is_dir()


class EpisodeFolders:
    """The episodes at a place: those of the merged file or, during a run, those of its batches.

    ``twins`` is None if the twins are unknown or missing, with the reason in ``without_twins``. ``dataset`` is the data set of
    the twins; None means the one that the episodes were made from. ``cache`` stores the twins of a data set at a URL. Raises
    UsageError if there are no attempts, and EpisodesError if their only file cannot be read.
    """

    def __init__(self, place: str, cache: Path, dataset: str | None = None):
        self.root = Path(place)
        self._places = _places(self.root)
        self._config = _configuration(self.root)
        self.twins: TwinFolders | None = None
        self.without_twins = ""
        self._find_twins(dataset, cache)
        self.attempts, self.without_attempts = self._attempts()
        if not self._places and self.attempts is None:
            raise UsageError(f"{place}: no recorded episode there; `manitwin trajectories` makes some")

    def __len__(self) -> int:
        return len(self._places)

    def said(self, number: int) -> dict[str, Any]:
        """Return an episode's data except arrays; raises UsageError for an unknown number, EpisodesError for a broken episode."""
        place = self._place(number)
        with EpisodeFile(place.file) as file:
            return file.metadata(place.number)

    def metadata_or_errors(self, numbers: range) -> list[dict[str, Any] | str]:
        """Return the same for several episodes, opening each file once; a broken episode gives its error message."""
        found: list[dict[str, Any] | str] = []
        for path, places in groupby((self._places[number] for number in numbers), key=lambda place: place.file):
            told = list(places)
            try:
                if told[0].problem is not None:
                    raise EpisodesError(told[0].problem)
                with EpisodeFile(path) as file:
                    found += [_metadata_or_error(file, place.number) for place in told]
            except EpisodesError as error:
                found += [str(error)] * len(told)
        return found

    def episode(self, number: int) -> StoredEpisode:
        """Return an episode with consistent arrays; raises UsageError for an unknown number, EpisodesError for a
        broken episode.
        """
        place = self._place(number)
        name = f"{place.file}: traj_{place.number}"
        with EpisodeFile(place.file) as file:
            file.metadata(place.number)
            size = file.content.size_bytes(f"traj_{place.number}")
            if size > MOST_EPISODE_BYTES:
                raise EpisodesError(
                    f"{name}: {size:,} bytes of arrays, {MOST_EPISODE_BYTES:,} at most are shown; load the file itself"
                )
            episode = file[place.number]
        checked_recording(episode)
        return episode

    def robot(self, name: str) -> Robot:
        """Return a robot of the package, or the one that the run was made with.

        Raises UsageError for any other robot, and ConfigError and Unavailable as ``load_robot`` does.
        """
        if name in (*shipped_robots(), *shipped_two_arms()):
            return load_robot(name)
        made_with = self._config.get("robot")
        if made_with is not None and made_with.endswith(".toml"):
            robot = load_robot(made_with)
            if robot.name == name:
                return robot
        raise UsageError(
            f"the robot {printable_line(name, max_characters=80)} is none of the package, nor that of the run"
        )

    def robot_of(self, recorded: RecordedRobot) -> Robot:
        """Return the robot of a recording; raises ConfigError if the robot of this name now has other joints or bases."""
        robot = self.robot(recorded.name)
        now = recorded_robot(robot)
        if (now.arm_joints, now.hand_state, now.arms) != (recorded.arm_joints, recorded.hand_state, recorded.arms):
            raise ConfigError(f"the robot {robot.name} has other joints or bases than it had as it was recorded")
        return robot

    def _place(self, number: int) -> _Place:
        if not 0 <= number < len(self._places):
            raise UsageError("there is no episode of this number")
        place = self._places[number]
        if place.problem is not None:
            raise EpisodesError(place.problem)
        return place

    def _find_twins(self, dataset: str | None, cache: Path) -> None:
        where = dataset or self._config.get("dataset")
        if where is None:
            self.without_twins = f"{self.root}: does not say whose twins it is of; name their data set (--twins)"
            return
        if dataset is None and "://" in where:  # a URL named in a file is not fetched without the user's consent
            self.without_twins = f"{self.root}: its twins are at {where}; name it to have them fetched (--twins)"
            return
        try:
            self.twins = TwinFolders(where, cache if "://" in where else None, MOVED)
        except ManiTwinError as error:
            if dataset is not None:
                raise
            self.without_twins = str(error)

    def _attempts(self) -> tuple[AttemptRows | None, str]:
        """Return the table of all attempts if it matches these episodes, else None with the reason, if any."""
        path = self.root / ATTEMPTS
        if not self.root.is_dir() or _merged(self.root) is None or not path.is_file():
            return None, ""
        try:
            rows = AttemptRows(path)
        except EpisodesError as error:
            return None, str(error)
        if rows.kept != len(self):
            return (
                None,
                f"{path}: tells of {rows.kept} recorded episodes, and there are {len(self)}; run the episodes again",
            )
        return rows, ""


def _metadata_or_error(file: EpisodeFile, number: int) -> dict[str, Any] | str:
    try:
        return file.metadata(number)
    except EpisodesError as error:
        return str(error)


def _merged(folder: Path) -> Path | None:
    for file in (folder / MANISKILL / TRAJECTORIES, folder / TRAJECTORIES):
        if file.is_file():
            return file
    return None


def _places(root: Path) -> list[_Place]:
    if root.is_file():
        return _episodes_of_file(root)
    merged = _merged(root)
    if merged is not None:
        return _episodes_of_file(_check_inside(merged, root))
    files = sorted((root / BATCHES).glob(f"*/*/{EPISODES}"))
    with suppress(ManiTwinError):  # in the order of their attempts, if that can be read
        files = [folder / EPISODES for folder in batch_folders(root)]
    places: list[_Place] = []
    for file in files:
        try:
            places += _episodes_of_file(_check_inside(file, root))
        except EpisodesError as error:  # a broken batch is one line in the list
            places.append(_Place(file, 0, str(error)))
    return places


def _episodes_of_file(path: Path) -> list[_Place]:
    with EpisodeFile(path) as file:
        return [_Place(path, number) for number in range(len(file))]


def _check_inside(file: Path, root: Path) -> Path:
    if not file.resolve().is_relative_to(root.resolve()):
        raise EpisodesError(f"{file}: leads out of the folder; put the file itself there")
    return file


def _configuration(root: Path) -> dict[str, Any]:
    """Return the configuration of the run that a folder, or a file inside it, belongs to; empty if unknown."""
    folder = root.resolve() if root.is_dir() else root.resolve().parent
    for each in (folder, *list(folder.parents)[:3]):
        if (each / CONFIG).is_file():
            try:
                return read_configuration(each)
            except EpisodesError:
                return {}
    return {}
