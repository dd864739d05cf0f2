"""File and feature names of a LeRobotDataset v3.0, and its columns as arrays.

Source: lerobot 0.4.4, datasets/utils.py, datasets/lerobot_dataset.py and datasets/compute_stats.py.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

VERSION = "v3.0"
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
CHUNKS_SIZE = 1000
"""Files per folder ``chunk-000``."""

DATA_FILES_SIZE_IN_MB, VIDEO_FILES_SIZE_IN_MB = 100, 200
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES_PATH = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
CODEC = "camera.codec"
"""Key of the codec in a video feature's ``info``."""

DEFAULT_FEATURES: dict[str, str] = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
"""Features that every set has, with their types; each is a scalar per frame."""

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
STATISTICS = ("min", "max", "mean", "std", "count", *QUANTILES)

TIMESTAMP_TOLERANCE_S = 1e-4
"""Largest deviation of a timestamp from the frame grid that LeRobot accepts (``tolerance_s`` of LeRobotDataset)."""


def chunk_and_file(number: int) -> tuple[int, int]:
    """Return the chunk of the n-th file, and its number in the chunk."""
    return divmod(number, CHUNKS_SIZE)


def video_key(camera: str) -> str:
    """Return the feature name of a camera's pictures."""
    return f"observation.images.{camera}"


def write_json(path: Path, value: Any) -> None:
    """Write JSON in LeRobot's format: keys in insertion order, four spaces of indentation, no NaN."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(value, indent=4, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def arrays_of(table: pa.Table, features: dict[str, dict[str, Any]]) -> dict[str, np.ndarray]:
    """Return the columns of a table as arrays, without videos."""
    result = {}
    for name, feature in features.items():
        if feature["dtype"] == "video":
            continue
        column = table[name].combine_chunks()
        width = feature["shape"][0]
        flat = column if width == 1 else column.flatten()
        array = flat.to_numpy(zero_copy_only=False)
        result[name] = array if width == 1 else array.reshape(-1, width)
    return result
