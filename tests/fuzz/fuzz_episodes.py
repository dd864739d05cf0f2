"""Recorded episodes that somebody has changed: HDF5, LeRobot, tables of attempts and records of batches."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import h5py
from fuzz_target import Case, target
from lerobot_sets import written
from synthetic_episodes import attempt, episode, with_granules

from manitwin.episodes.attempts import count_attempts, read_attempts, write_attempts
from manitwin.episodes.hdf5_file import EpisodeFile, write_episodes
from manitwin.episodes.lerobot.read import read_lerobot
from manitwin.episodes.recording_arrays import checked_recording
from manitwin.errors import EpisodesError
from manitwin.web.episode_document import episode_document
from manitwin.web.episode_folders import EpisodeFolders
from manitwin.web.episode_pages import episode_page, recorded_row
from manitwin.web.links import ServerLinks
from manitwin.web.twin_document import document_bytes


def hdf5(folder: Path) -> None:
    write_episodes(folder / "episodes.h5", (episode(i, steps=4) for i in range(2)))
    with h5py.File(folder / "linked.h5", "w") as file, h5py.File(folder / "episodes.h5", "r") as other:
        for name in other:
            other.copy(name, file)
        first = file["traj_0"]
        name = next(key for key in first if isinstance(first[key], h5py.Dataset))
        del first[name]
        first[name] = h5py.ExternalLink("../fuzz-outside", "/x")


def read_hdf5(case: Case) -> None:
    with EpisodeFile(case.file) as file:
        for number in range(len(file)):
            file.metadata(number)
            checked_recording(file[number])


def shown(folder: Path) -> None:
    (folder / "maniskill").mkdir()
    write_episodes(folder / "maniskill" / "trajectory.h5", [with_granules(episode(0, steps=4)), episode(1, steps=4)])
    attempts(folder)


def show(case: Case) -> None:
    episodes = EpisodeFolders(str(case.folder), case.folder / "cache")
    for number in range(len(episodes)):
        with suppress(EpisodesError):
            recorded_row(episodes.said(number), number)
            episode_page(episodes.said(number), number, len(episodes), ServerLinks(), None, None)
        with suppress(EpisodesError):
            document_bytes(episode_document(episodes.episode(number), number, episodes, ServerLinks()))
    if episodes.attempts is not None:
        episodes.attempts.page(0, 10)


def lerobot(folder: Path) -> None:
    written(folder / "set", 2)


def read_set(case: Case) -> None:
    for each in read_lerobot(case.folder / "set").episodes:
        assert each is not None


def attempts(folder: Path) -> None:
    write_attempts(folder / "attempts.parquet", [attempt(i) for i in range(5)])


target("hdf5", hdf5, read_hdf5)
target("lerobot", lerobot, read_set, files=("*.json", "*.parquet", "*.jsonl"), weight=0.5)
target("attempts", attempts, lambda case: count_attempts(read_attempts(case.file)))
target("shown_episodes", shown, show, files=("*.h5", "*.parquet"), weight=0.3)
