"""Writer of LeRobotDataset v3.0. Format: see ``lerobot_format``; docs/episodes.md describes every feature."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.episodes.downsampling import downsample
from manitwin.episodes.lerobot.episode_rows import EpisodeRows
from manitwin.episodes.lerobot.feature_statistics import PooledStatistics, episode_statistics, quantiles_of_files
from manitwin.episodes.lerobot.frame_features import Feature, features_of, frames_of, schema_of, table_of
from manitwin.episodes.lerobot.lerobot_format import (
    CHUNKS_SIZE,
    DATA_FILES_SIZE_IN_MB,
    DATA_PATH,
    INFO,
    STATS,
    TASKS,
    VERSION,
    VIDEO_FILES_SIZE_IN_MB,
    VIDEO_PATH,
    chunk_and_file,
    write_json,
)
from manitwin.episodes.lerobot.videos import CameraVideos, VideoColumns
from manitwin.episodes.recording import RATE_HZ
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.errors import EpisodesError
from manitwin.twin.store import atomic_folder


@dataclass(frozen=True)
class LeRobotSummary:
    """Numbers of episodes, frames and tasks of a written data set."""

    episodes: int
    frames: int
    tasks: int


def write_lerobot(
    episodes: Iterable[StoredEpisode],
    place: Path,
    *,
    seed: int = 0,
    data_files_size_in_mb: int = DATA_FILES_SIZE_IN_MB,
    videos: Sequence[CameraVideos] = (),
    granules: bool = False,
    rate_hz: int = RATE_HZ,
) -> LeRobotSummary:
    """Write the episodes of one robot as a data set, numbered in order; the folder appears complete or not at all.

    Every instruction is a task; ``seed`` and the episode's id select the one assigned to its frames. With ``videos`` each
    episode must have pictures of every camera. With ``granules`` frames contain granule counts (zeros for an episode
    without). Frames, and pictures, are at ``rate_hz`` per second (``downsample``).

    One episode is in memory at a time. The output is deterministic to the byte. Raises EpisodesError for no episode, several
    robots, an episode without instructions, and pictures that do not match.
    """
    with atomic_folder(place) as root:
        writer: _DatasetWriter | None = None
        with ExitStack() as stack:
            for episode in episodes:
                if writer is None:
                    columns = [VideoColumns(camera, root, rate_hz) for camera in videos]
                    opened = _DatasetWriter(root, episode, seed, data_files_size_in_mb, columns, granules, rate_hz)
                    writer = stack.enter_context(opened)
                writer.add(episode)
        if writer is None:
            raise EpisodesError(
                f"{place}: there is no episode, and LeRobot cannot read an empty set; keep at least one episode"
            )
        writer.write_metadata()
        return LeRobotSummary(writer.rows.count, writer.frames, len(writer.tasks))


class _DatasetWriter:
    """A data set being written."""

    def __init__(
        self,
        root: Path,
        first: StoredEpisode,
        seed: int,
        data_files_size_in_mb: int,
        videos: list[VideoColumns],
        granules: bool,
        rate_hz: int,
    ):
        self.root, self.robot, self.seed, self.videos, self.rate_hz = root, first.robot, seed, videos, rate_hz
        self.features: tuple[Feature, ...] = features_of(first.robot, granules=granules)
        self.schema = schema_of(self.features)
        self.data = _DataFiles(root, self.schema, data_files_size_in_mb)
        self.size_mb = data_files_size_in_mb
        keys = [column.key for column in videos]
        self.rows = EpisodeRows(root, self.features, keys, data_files_size_in_mb)
        self.tasks: dict[str, int] = {}
        self.frames = 0
        self.pooled: dict[str, PooledStatistics] = {}

    def __enter__(self) -> _DatasetWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.data.close()
        self.rows.close()

    def add(self, episode: StoredEpisode) -> None:
        """Write an episode's frames and its row."""
        episode = replace(episode, recording=downsample(episode.recording, self.rate_hz))
        attempt, steps = episode.attempt, episode.recording.steps
        if episode.robot != self.robot:
            raise EpisodesError(
                f"episode {attempt.episode_id}: robot {episode.robot.name}, the set's is {self.robot.name}; write"
                f" one set per robot"
            )
        tasks = list(dict.fromkeys(attempt.instructions))
        if not tasks:
            raise EpisodesError(
                f"episode {attempt.episode_id}: it has no instruction, but LeRobot needs a task; run it again"
            )
        for task in tasks:
            self.tasks.setdefault(task, len(self.tasks))
        chosen = self.tasks[_chosen(tasks, self.seed, attempt.episode_id)]
        frames = frames_of(episode, self.rows.count, self.frames, chosen, self.rate_hz)
        frames = {feature.name: frames[feature.name] for feature in self.features}
        chunk, file = self.data.write(table_of(frames, self.features, self.schema))
        statistics = episode_statistics(frames)
        row: dict[str, Any] = {
            "episode_index": self.rows.count,
            "tasks": tasks,
            "length": steps,
            "data/chunk_index": chunk,
            "data/file_index": file,
            "dataset_from_index": self.frames,
            "dataset_to_index": self.frames + steps,
        }
        for column in self.videos:
            more, statistics[column.key] = column.row(attempt.episode_id, steps)
            row |= more
        self.rows.write(row, attempt, statistics)
        for name, of_episode in statistics.items():
            if name in self.pooled:
                self.pooled[name].add(of_episode)
            else:
                self.pooled[name] = PooledStatistics(of_episode)
        self.frames += steps

    def write_metadata(self) -> None:
        """Write the files that describe the whole set, info.json last."""
        quantiles = quantiles_of_files(self.data.files, self.features, self.pooled)
        quantiles |= {column.key: self.rows.mean_quantiles(column.key) for column in self.videos}
        write_json(self.root / STATS, {n: pooled.statistics(quantiles[n]) for n, pooled in self.pooled.items()})
        _write_tasks(self.root / TASKS, list(self.tasks))
        info = {
            "codebase_version": VERSION,
            "robot_type": self.robot.name,
            "total_episodes": self.rows.count,
            "total_frames": self.frames,
            "total_tasks": len(self.tasks),
            "chunks_size": CHUNKS_SIZE,
            "data_files_size_in_mb": self.size_mb,
            "video_files_size_in_mb": VIDEO_FILES_SIZE_IN_MB,
            "fps": self.rate_hz,
            "splits": {"train": f"0:{self.rows.count}"},
            "data_path": DATA_PATH,
            "video_path": VIDEO_PATH if self.videos else None,
            "features": {
                **{feature.name: feature.info for feature in self.features},
                **{column.key: column.info for column in self.videos},
            },
        }
        write_json(self.root / INFO, info)


def _chosen(tasks: Sequence[str], seed: int, episode_id: str) -> str:
    digest = hashlib.sha256(f"{seed}:{episode_id}".encode()).digest()
    return tasks[int.from_bytes(digest[:8]) % len(tasks)]


class _DataFiles:
    """Data files with a row group per episode; a new file is started before one would exceed the size limit."""

    def __init__(self, root: Path, schema: pa.Schema, size_mb: int):
        self.root, self.schema, self.most_bytes = root, schema, size_mb << 20
        self.files: list[Path] = []
        self._stream: Any = None
        self._writer: Any = None
        self._episodes = 0

    def write(self, table: pa.Table) -> tuple[int, int]:
        """Write an episode and return its chunk and file numbers."""
        if self._writer is not None:
            size = self._stream.tell()
            if size + size / self._episodes > self.most_bytes:
                self.close()
        if self._writer is None:
            chunk, file = chunk_and_file(len(self.files))
            path = self.root / DATA_PATH.format(chunk_index=chunk, file_index=file)
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = path.open("wb")
            self._writer = pq.ParquetWriter(self._stream, self.schema, compression="snappy", version="2.6")
            self.files.append(path)
            self._episodes = 0
        self._writer.write_table(table)
        self._episodes += 1
        return chunk_and_file(len(self.files) - 1)

    def close(self) -> None:
        """Finish the current file."""
        if self._writer is not None:
            self._writer.close()
            self._stream.close()
            self._writer = None


def _write_tasks(path: Path, tasks: list[str]) -> None:
    """Write the tasks in pandas format with the task text as index, by which LeRobot looks tasks up."""
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": pa.array(tasks, pa.string())})
    told = {
        "index_columns": ["task"],
        "column_indexes": [
            {
                "name": None,
                "field_name": None,
                "pandas_type": "unicode",
                "numpy_type": "object",
                "metadata": {"encoding": "UTF-8"},
            }
        ],
        "columns": [
            {"name": n, "field_name": n, "pandas_type": kind, "numpy_type": numpy_type, "metadata": None}
            for n, kind, numpy_type in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
        ],
        "creator": {"library": "pyarrow", "version": pa.__version__},
        "pandas_version": "2.2.0",
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(
        table.replace_schema_metadata({"pandas": json.dumps(told)}), path, compression="snappy", version="2.6"
    )
