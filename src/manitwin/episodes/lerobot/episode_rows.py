"""Rows of meta/episodes: location of an episode's data, its facts, and the statistics of its features."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.episodes.attempts import Attempt
from manitwin.episodes.lerobot.feature_statistics import Statistics
from manitwin.episodes.lerobot.frame_features import Feature
from manitwin.episodes.lerobot.lerobot_format import EPISODES_PATH, QUANTILES, STATISTICS, chunk_and_file

FACTS: dict[str, pa.DataType] = {
    "episode_id": pa.string(),
    "robot": pa.string(),
    "skill": pa.string(),
    "twin_id": pa.string(),
    "category": pa.string(),
    "scene_id": pa.string(),
    "seed": pa.int64(),
    "others": pa.int64(),
    "outcome": pa.string(),
    "grasp_id": pa.string(),
    "grasp_type": pa.string(),
    "transferred": pa.bool_(),
    "position_error_m": pa.float64(),
    "tilt_rad": pa.float64(),
    "yaw_error_rad": pa.float64(),
    "slip_m": pa.float64(),
}
"""Columns added to LeRobot's: fields of Attempt."""

_WAITING = 500


class EpisodeRows:
    """Writes rows in batches, and starts a new file when one exceeds the size limit."""

    def __init__(self, root: Path, features: Sequence[Feature], video_keys: Sequence[str], size_mb: int):
        self.root, self.most_bytes = root, size_mb << 20
        self.schema = _schema(features, video_keys)
        self.count = self._files = 0
        self._waiting: list[dict[str, Any]] = []
        self._stream: Any = None
        self._writer: Any = None
        self._quantiles = {key: (0, np.zeros((len(QUANTILES), 3, 1, 1))) for key in video_keys}

    def write(self, row: dict[str, Any], attempt: Attempt, statistics: dict[str, Statistics]) -> None:
        """Append a row."""
        if self._writer is None:
            self._open()
        chunk, file = chunk_and_file(self._files - 1)
        whole = {**row, "meta/episodes/chunk_index": chunk, "meta/episodes/file_index": file}
        whole |= {name: getattr(attempt, name) for name in FACTS}
        whole |= {f"stats/{feature}/{name}": said[name] for feature, said in statistics.items() for name in STATISTICS}
        for key, (count, total) in self._quantiles.items():
            said = statistics[key]
            weight = said["count"][0]
            self._quantiles[key] = (count + weight, total + weight * np.array([said[name] for name in QUANTILES]))
        self._waiting.append(whole)
        self.count += 1
        if len(self._waiting) >= _WAITING:
            self._flush()
            if self._stream.tell() >= self.most_bytes:
                self.close()

    def mean_quantiles(self, key: str) -> np.ndarray:
        """Return the mean of the episodes' quantiles ``(5, 3, 1, 1)`` of a camera, weighted by their numbers of pictures."""
        count, total = self._quantiles[key]
        mean: np.ndarray = total / count
        return mean

    def close(self) -> None:
        """Write the pending rows and finish the file."""
        if self._writer is not None:
            self._flush()
            self._writer.close()
            self._stream.close()
            self._writer = None

    def _open(self) -> None:
        chunk, file = chunk_and_file(self._files)
        path = self.root / EPISODES_PATH.format(chunk_index=chunk, file_index=file)
        path.parent.mkdir(parents=True, exist_ok=True)
        self._stream = path.open("wb")
        self._writer = pq.ParquetWriter(self._stream, self.schema, compression="snappy", version="2.6")
        self._files += 1

    def _flush(self) -> None:
        if self._waiting:
            self._writer.write_table(pa.Table.from_pylist(self._waiting, schema=self.schema))
            self._waiting = []


def _schema(features: Sequence[Feature], video_keys: Sequence[str]) -> pa.Schema:
    whole, real = pa.int64(), pa.float64()
    columns: dict[str, pa.DataType] = {
        "episode_index": whole,
        "tasks": pa.list_(pa.string()),
        "length": whole,
        "data/chunk_index": whole,
        "data/file_index": whole,
        "dataset_from_index": whole,
        "dataset_to_index": whole,
    }
    for key in video_keys:
        columns |= {f"videos/{key}/{name}": whole for name in ("chunk_index", "file_index")}
        columns |= {f"videos/{key}/{name}": real for name in ("from_timestamp", "to_timestamp")}
    columns |= {"meta/episodes/chunk_index": whole, "meta/episodes/file_index": whole, **FACTS}
    for feature in features:
        columns |= _statistics(feature.name, pa.list_(real))
    for key in video_keys:
        columns |= _statistics(key, pa.list_(pa.list_(pa.list_(real))))
    return pa.schema(list(columns.items()))


def _statistics(name: str, kind: pa.DataType) -> dict[str, pa.DataType]:
    return {f"stats/{name}/{n}": pa.list_(pa.int64()) if n == "count" else kind for n in STATISTICS}
