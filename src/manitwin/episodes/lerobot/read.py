"""Reader of LeRobotDataset v3.0 without LeRobot, which checks everything that LeRobot's loader relies on but does not verify.

A gap in the episode numbers shifts every later video, frames outside their episode's rows are attributed to another episode,
and timestamps off the frame grid fail in the middle of a training run. Each of these is an error here that names the file.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from manitwin.episodes.lerobot.checks import (
    EpisodeStatistics,
    check_data_files,
    check_statistics,
    check_videos,
    statistics_of,
)
from manitwin.episodes.lerobot.lerobot_format import (
    DATA_PATH,
    DEFAULT_FEATURES,
    EPISODES_PATH,
    INFO,
    STATISTICS,
    STATS,
    TASKS,
    VERSION,
    VIDEO_PATH,
    arrays_of,
    chunk_and_file,
)
from manitwin.errors import EpisodesError
from manitwin.formats.json_file import parse_json_object, read_json_object
from manitwin.formats.parquet_file import read_parquet
from manitwin.formats.printable import printable_line

_REMEDY = "write the set again"
_INFO: dict[str, type] = {
    **dict.fromkeys(("codebase_version", "robot_type", "data_path"), str),
    **dict.fromkeys(("total_episodes", "total_frames", "total_tasks", "chunks_size", "fps"), int),
    **dict.fromkeys(("data_files_size_in_mb", "video_files_size_in_mb"), int),
    **dict.fromkeys(("splits", "features"), dict),
}
_DTYPES = frozenset(
    {"video", "bool", "float32", "float64", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32"}
)
_SHOWN_CHARACTERS = 400
_NAME_CHARACTERS = 200
_WIDEST = 1 << 16
_NUMBERS = (
    *("episode_index", "length", "data/chunk_index", "data/file_index", "dataset_from_index", "dataset_to_index"),
    *("meta/episodes/chunk_index", "meta/episodes/file_index"),
)


@dataclass(frozen=True)
class LeRobotSet:
    """A data set with a valid layout: ``tasks`` by ``task_index``; ``episodes`` are rows without their statistics."""

    root: Path
    info: dict[str, Any]
    tasks: tuple[str, ...]
    episodes: tuple[dict[str, Any], ...]

    @property
    def features(self) -> dict[str, dict[str, Any]]:
        """Features by name, as in info.json."""
        features: dict[str, dict[str, Any]] = self.info["features"]
        return features

    def frames(self, episode_index: int) -> dict[str, np.ndarray]:
        """Return an episode's features as arrays ``(T, width)``, scalars ``(T,)``, without pictures."""
        row = self.episodes[episode_index]
        path = self.root / self.info["data_path"].format(
            chunk_index=row["data/chunk_index"], file_index=row["data/file_index"]
        )
        table = read_parquet(path, EpisodesError, remedy=_REMEDY, inside=self.root)
        return arrays_of(table.filter(pc.field("episode_index") == episode_index), self.features)


def read_lerobot(root: Path, *, decode_videos: bool = False) -> LeRobotSet:
    """Read and check a data set, with one data file in memory at a time.

    Videos are checked by their headers, or with ``decode_videos`` by decoding every frame. Raises EpisodesError with file,
    cause and remedy for the first violation.
    """
    info = _info(root)
    tasks = _tasks(root / TASKS, info["total_tasks"])
    episodes, statistics = _episodes(root, info, set(tasks))
    found = LeRobotSet(root, info, tasks, episodes)
    frames = 0
    for count in check_data_files(root, info, tasks, episodes, statistics):
        frames += count
    if frames != info["total_frames"]:
        raise _wrong(root / INFO, f"total_frames is {info['total_frames']}, but there are {frames}")
    check_statistics(root / STATS, info["features"], statistics)
    check_videos(root, info, episodes, decode=decode_videos)
    return found


def _wrong(path: Path, cause: str) -> EpisodesError:
    return EpisodesError(f"{path}: {printable_line(cause, max_characters=_SHOWN_CHARACTERS)}; {_REMEDY}")


def _info(root: Path) -> dict[str, Any]:
    path = root / INFO
    info = read_json_object(path, EpisodesError, inside=root, name=str(path), remedy=_REMEDY)
    for name, kind in _INFO.items():
        if type(info.get(name)) is not kind:
            raise _wrong(path, f"{name} is {info.get(name)!r}, not of type {kind.__name__}")
    if info["codebase_version"] != VERSION:
        raise _wrong(path, f"codebase_version is {info['codebase_version']}, this reads {VERSION}")
    if info["fps"] < 1 or info["total_episodes"] < 1 or info["splits"] != {"train": f"0:{info['total_episodes']}"}:
        raise _wrong(path, f"fps {info['fps']}, {info['total_episodes']} episodes, splits {info['splits']}")
    if info["data_path"] != DATA_PATH or info.get("video_path") not in (None, VIDEO_PATH):
        raise _wrong(path, f"data_path is {info['data_path'][:80]!r}, not {DATA_PATH}, or video_path not {VIDEO_PATH}")
    for name, feature in info["features"].items():
        _check_feature(path, name, feature)
    for name, dtype in DEFAULT_FEATURES.items():
        feature = info["features"].get(name)
        if feature is None or feature["dtype"] != dtype or feature["shape"] != [1]:
            raise _wrong(path, f"the feature {name} is {feature}, not one number of type {dtype}")
    return info


def _check_feature(path: Path, name: str, feature: Any) -> None:
    dtype = feature.get("dtype") if isinstance(feature, dict) else None
    if not isinstance(dtype, str) or dtype not in _DTYPES or len(name) > _NAME_CHARACTERS:
        raise _wrong(path, f"the feature {name[:80]!r} is {str(feature)[:80]}")
    shape: Any = feature.get("shape")
    names: Any = feature.get("names")
    whole = isinstance(shape, list) and all(type(n) is int and 0 < n <= _WIDEST for n in shape)
    if "/" in name or name in (".", "..") or not name.isprintable() or not whole or not isinstance(names, list | None):
        raise _wrong(path, f"the feature {name!r} is {str(feature)[:80]}")
    if feature["dtype"] == "video":
        if len(shape) != 3 or names != ["height", "width", "channels"] or shape[2] != 3:
            raise _wrong(path, f"the video {name} has the shape {shape} and names {names}, not height, width, channels")
    elif len(shape) != 1 or (names is not None and len(names) != shape[0]):
        raise _wrong(path, f"the feature {name} has the shape {shape} and {len(names or [])} names")


def _tasks(path: Path, total: int) -> tuple[str, ...]:
    table = read_parquet(path, EpisodesError, remedy=_REMEDY)
    said = (table.schema.metadata or {}).get(b"pandas", b"{}")
    told = parse_json_object(said, f"{path}: pandas", EpisodesError, remedy=_REMEDY)
    if told.get("index_columns") != ["task"] or {"task", "task_index"} - set(table.column_names):
        raise _wrong(path, "its pandas index is not 'task', by which LeRobot looks tasks up")
    tasks: list[str] = table["task"].to_pylist()
    if table["task_index"].to_pylist() != list(range(len(tasks))) or len(tasks) != total:
        raise _wrong(path, f"task_index does not count from 0 to {total - 1} in order")
    if len(set(tasks)) != len(tasks) or not all(tasks):
        raise _wrong(path, "a task is empty or repeated")
    return tuple(tasks)


def _episode_tables(root: Path) -> Iterator[tuple[Path, int, pa.Table]]:
    files = sorted((root / "meta" / "episodes").glob("*/*.parquet"))
    for number, path in enumerate(files):
        chunk, file = chunk_and_file(number)
        if path != root / EPISODES_PATH.format(chunk_index=chunk, file_index=file):
            raise _wrong(path, f"the {number + 1}th file of episodes should be chunk {chunk}, file {file}")
        yield path, number, read_parquet(path, EpisodesError, remedy=_REMEDY, inside=root)


def _episodes(
    root: Path, info: dict[str, Any], tasks: set[str]
) -> tuple[tuple[dict[str, Any], ...], dict[str, EpisodeStatistics]]:
    needed = [*_NUMBERS, "tasks", *(f"stats/{feature}/{name}" for feature in info["features"] for name in STATISTICS)]
    statistics: dict[str, list[EpisodeStatistics]] = {name: [] for name in info["features"]}
    rows: list[dict[str, Any]] = []
    end = 0
    for path, number, table in _episode_tables(root):
        missing = [name for name in needed if name not in table.column_names]
        if missing:
            raise _wrong(path, f"has no column {missing[0]}")
        for name, feature in info["features"].items():
            statistics[name].append(statistics_of(path, table, name, feature))
        for name in _NUMBERS:
            if table.schema.field(name).type != pa.int64() or table[name].null_count:
                raise _wrong(path, f"{name} are not integers")
        if table.schema.field("tasks").type != pa.list_(pa.string()):
            raise _wrong(path, "tasks are not lists of texts")
        for row in table.select([name for name in table.column_names if not name.startswith("stats/")]).to_pylist():
            where = f"episode {row['episode_index']}"
            if row["episode_index"] != len(rows):
                raise _wrong(
                    path, f"{where} stands where episode {len(rows)} should be: LeRobot finds episodes by their place"
                )
            if (row["meta/episodes/chunk_index"], row["meta/episodes/file_index"]) != chunk_and_file(number):
                raise _wrong(path, f"{where} says that it is in another file")
            if row["dataset_from_index"] != end or row["dataset_to_index"] - end != row["length"] or row["length"] < 1:
                raise _wrong(
                    path,
                    f"{where} has {row['length']} frames from {row['dataset_from_index']} to {row['dataset_to_index']},"
                    f" the one before ends at {end}",
                )
            if not row["tasks"] or not set(row["tasks"]) <= tasks:
                raise _wrong(path, f"{where} has the tasks {row['tasks']}, which are not all in {TASKS}")
            end = row["dataset_to_index"]
            rows.append(row)
    if len(rows) != info["total_episodes"]:
        raise _wrong(root / INFO, f"total_episodes is {info['total_episodes']}, but there are {len(rows)}")
    together = {
        name: {kind: np.concatenate([each[kind] for each in files]) for kind in files[0]}
        for name, files in statistics.items()
    }
    return tuple(rows), together
