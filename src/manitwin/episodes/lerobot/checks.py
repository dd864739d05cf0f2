"""Consistency checks of a LeRobotDataset: data files and videos against the episode rows, statistics against both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from manitwin.episodes.lerobot.lerobot_format import STATISTICS, TIMESTAMP_TOLERANCE_S, arrays_of, chunk_and_file
from manitwin.episodes.video_reading import VideoReader
from manitwin.errors import EpisodesError
from manitwin.formats.json_file import read_json_object
from manitwin.formats.parquet_file import read_parquet

_REMEDY = "write the set again"
_ROUNDING = 1e-6
"""Relative tolerance of a statistic."""


EpisodeStatistics = dict[str, np.ndarray]
"""``min, max, mean (N, ...)`` and ``count (N, 1)`` of a feature in each of N episodes."""


def statistics_of(path: Path, table: pa.Table, name: str, feature: dict[str, Any]) -> EpisodeStatistics:
    """Return the statistics of a feature in an episodes file; raises EpisodesError for lists of the wrong length or type."""
    result = {}
    for kind in ("min", "max", "mean", "count"):
        shape = (1,) if kind == "count" else _shape(feature)
        flat = table[f"stats/{name}/{kind}"].combine_chunks()
        while pa.types.is_list(flat.type):
            flat = flat.flatten()
        if not (pa.types.is_floating(flat.type) or pa.types.is_integer(flat.type)):
            raise EpisodesError(f"{path}: stats/{name}/{kind} are of type {flat.type}, not numbers; {_REMEDY}")
        if flat.null_count or len(flat) != len(table) * int(np.prod(shape)):
            raise EpisodesError(f"{path}: stats/{name}/{kind} has not {shape} numbers in each row; {_REMEDY}")
        result[kind] = flat.to_numpy(zero_copy_only=False).astype(np.float64).reshape(len(table), *shape)
    return result


def _shape(feature: dict[str, Any]) -> tuple[int, ...]:
    return (3, 1, 1) if feature["dtype"] == "video" else tuple(feature["shape"])


def check_data_files(
    root: Path,
    info: dict[str, Any],
    tasks: Sequence[str],
    rows: Sequence[dict[str, Any]],
    statistics: dict[str, EpisodeStatistics],
) -> Iterator[int]:
    """Yield the number of frames of each data file once it is checked; raises EpisodesError."""
    files = sorted((root / "data").glob("*/*.parquet"))
    by_file: dict[tuple[int, int], list[dict[str, Any]]] = {}
    for row in rows:
        by_file.setdefault((row["data/chunk_index"], row["data/file_index"]), []).append(row)
    wanted = [root / info["data_path"].format(chunk_index=chunk, file_index=file) for chunk, file in by_file]
    if files != wanted or list(by_file) != [chunk_and_file(number) for number in range(len(files))]:
        odd = sorted(set(files) ^ set(wanted)) or files or [root / "data"]
        raise EpisodesError(
            f"{odd[0]}: the data files do not match those named by the episodes, in their order; {_REMEDY}"
        )
    features = {name: f for name, f in info["features"].items() if f["dtype"] != "video"}
    for path, episodes in zip(files, by_file.values(), strict=True):
        table = _table(path, features)
        if len(table) != sum(row["length"] for row in episodes):
            raise EpisodesError(f"{path}: {len(table)} frames, but its episodes have another number; {_REMEDY}")
        begin = 0
        for row in episodes:
            told = {
                name: {kind: v[row["episode_index"]] for kind, v in each.items()} for name, each in statistics.items()
            }
            _check_episode(path, table.slice(begin, row["length"]), features, row, told, tasks, info["fps"])
            begin += row["length"]
        yield len(table)


def _table(path: Path, features: dict[str, dict[str, Any]]) -> pa.Table:
    table = read_parquet(path, EpisodesError, remedy=_REMEDY)
    if set(table.column_names) != set(features):
        odd = sorted(set(table.column_names) ^ set(features))
        raise EpisodesError(f"{path}: the column {odd[0]} is not in both the file and info.json; {_REMEDY}")
    for name, feature in features.items():
        value = pa.bool_() if feature["dtype"] == "bool" else pa.type_for_alias(feature["dtype"])
        width = feature["shape"][0]
        kind = table.schema.field(name).type
        right = kind == value if width == 1 else pa.types.is_fixed_size_list(kind) and kind.list_size == width
        if not right or (width > 1 and kind.value_type != value):
            raise EpisodesError(f"{path}: {name} is of type {kind}, info.json says {width} x {value}; {_REMEDY}")
        if table[name].null_count:
            raise EpisodesError(f"{path}: {name} has empty cells; {_REMEDY}")
    return table


def _check_episode(
    path: Path,
    table: pa.Table,
    features: dict[str, dict[str, Any]],
    row: dict[str, Any],
    statistics: dict[str, EpisodeStatistics],
    tasks: Sequence[str],
    fps: int,
) -> None:
    where = f"{path}: episode {row['episode_index']}"
    frames = arrays_of(table, features)
    number = np.arange(row["length"])
    for name, right in (
        ("episode_index", np.full_like(number, row["episode_index"])),
        ("index", row["dataset_from_index"] + number),
        ("frame_index", number),
    ):
        if not np.array_equal(frames[name], right):
            raise EpisodesError(f"{where}: {name} does not count as the episode's row says; {_REMEDY}")
    late = np.abs(frames["timestamp"] - number / fps).max()
    if not late <= TIMESTAMP_TOLERANCE_S:
        raise EpisodesError(f"{where}: a timestamp is {late:.4g} s off frame_index / fps; {_REMEDY}")
    used = np.unique(frames["task_index"])
    if used[0] < 0 or used[-1] >= len(tasks) or not {tasks[i] for i in used} <= set(row["tasks"]):
        raise EpisodesError(f"{where}: task_index {used.tolist()} is none of its tasks; {_REMEDY}")
    if "next.done" in frames and not np.array_equal(frames["next.done"], number == number[-1]):
        raise EpisodesError(f"{where}: next.done is not true at the last frame alone; {_REMEDY}")
    for name, array in frames.items():
        values = np.asarray(array, np.float64).reshape(len(number), -1)
        if not np.isfinite(values).all():
            raise EpisodesError(f"{where}: {name} is not finite; {_REMEDY}")
        told = statistics[name]
        right_count = told["count"].tolist() == [len(number)]
        ends = _close(told["min"], values.min(0)) and _close(told["max"], values.max(0))
        if not right_count or not ends or not _close(told["mean"], values.mean(0)):
            raise EpisodesError(f"{where}: its statistics of {name} do not match its frames; {_REMEDY}")


def check_statistics(path: Path, features: dict[str, dict[str, Any]], statistics: dict[str, EpisodeStatistics]) -> None:
    """Check that stats.json has all features and agrees with the pooled statistics of the episodes; raises EpisodesError."""
    stats = read_json_object(path, EpisodesError, inside=path.parent.parent, name=str(path), remedy=_REMEDY)
    for name, feature in features.items():
        if not isinstance(stats.get(name), dict) or set(stats[name]) != set(STATISTICS):
            raise EpisodesError(f"{path}: some statistics of {name} are missing; {_REMEDY}")
        shape = _shape(feature)
        try:
            told = {kind: np.array(value, float) for kind, value in stats[name].items()}
        except (ValueError, TypeError, OverflowError) as error:
            raise EpisodesError(
                f"{path}: the statistics of {name} are not numbers ({str(error)[:120]}); {_REMEDY}"
            ) from error
        if not all(np.isfinite(value).all() for value in told.values()):
            raise EpisodesError(f"{path}: the statistics of {name} are not finite; {_REMEDY}")
        wrong = [kind for kind, value in told.items() if value.shape != ((1,) if kind == "count" else shape)]
        if wrong:
            raise EpisodesError(
                f"{path}: {wrong[0]} of {name} has the shape {told[wrong[0]].shape}, not {shape}; {_REMEDY}"
            )
        each = statistics[name]
        weights = each["count"].reshape(-1, *([1] * len(shape)))
        mean = (each["mean"] * weights).sum(0) / weights.sum()
        together = _close(told["min"], each["min"].min(0)) and _close(told["max"], each["max"].max(0))
        if not together or not _close(told["mean"], mean) or told["count"][0] != each["count"].sum():
            raise EpisodesError(f"{path}: the statistics of {name} do not match those of all episodes; {_REMEDY}")
        order = [told[kind] for kind in ("min", "q01", "q10", "q50", "q90", "q99", "max")]
        if any((later < earlier - _ROUNDING * (1 + np.abs(earlier))).any() for earlier, later in pairwise(order)):
            raise EpisodesError(f"{path}: the quantiles of {name} are not in order; {_REMEDY}")


def _close(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and bool((np.abs(one - other) <= _ROUNDING * (1 + np.abs(other))).all())


def check_videos(root: Path, info: dict[str, Any], episodes: Sequence[dict[str, Any]], *, decode: bool) -> None:
    """Check every episode's span in every camera's files; with ``decode`` every frame is decoded.

    Raises EpisodesError for a file that is missing, too short, or of another size or rate, for an episode off the frame grid
    or longer in pictures than in rows, and for two episodes that share frames.
    """
    for key, feature in info["features"].items():
        if feature["dtype"] == "video":
            _check_camera(root, key, feature, info, episodes, decode)


def _check_camera(
    root: Path,
    key: str,
    feature: dict[str, Any],
    info: dict[str, Any],
    episodes: Sequence[dict[str, Any]],
    decode: bool,
) -> None:
    spans: dict[tuple[int, int], list[tuple[float, float, int]]] = {}
    for row in episodes:
        where = f"episode {row['episode_index']} of {key}"
        try:
            file = (row[f"videos/{key}/chunk_index"], row[f"videos/{key}/file_index"])
            begin, end = row[f"videos/{key}/from_timestamp"], row[f"videos/{key}/to_timestamp"]
            if not all(type(each) is int for each in file) or not math.isfinite(begin + end):
                raise EpisodesError(f"{root}: {where} has no numbers in its columns; {_REMEDY}")
        except (KeyError, TypeError) as error:
            raise EpisodesError(f"{root}: {where} has no column {error}; {_REMEDY}") from error
        off = max(abs(time * info["fps"] - round(time * info["fps"])) / info["fps"] for time in (begin, end))
        if (
            begin < 0
            or off > TIMESTAMP_TOLERANCE_S
            or abs(end - begin - row["length"] / info["fps"]) > TIMESTAMP_TOLERANCE_S
        ):
            raise EpisodesError(
                f"{root}: {where} is from {begin:g} to {end:g} s, which are not {row['length']} frames at {info['fps']} Hz;"
                f" {_REMEDY}"
            )
        spans.setdefault(file, []).append((begin, end, row["episode_index"]))
    present = sorted((root / "videos" / key).glob("*/*.mp4"))
    wanted = [root / info["video_path"].format(video_key=key, chunk_index=c, file_index=f) for c, f in sorted(spans)]
    if present != wanted or sorted(spans) != [chunk_and_file(number) for number in range(len(spans))]:
        odd = sorted(set(present) ^ set(wanted)) or wanted
        raise EpisodesError(f"{odd[0]}: the files of {key} are not those that the episodes name; {_REMEDY}")
    for path, (_, clips) in zip(wanted, sorted(spans.items()), strict=True):
        _check_file(path, feature, info["fps"], sorted(clips), decode)


def _check_file(
    path: Path, feature: dict[str, Any], fps: int, clips: list[tuple[float, float, int]], decode: bool
) -> None:
    with VideoReader(path) as film:
        facts = film.facts
        frames = sum(1 for _ in film) if decode else facts.frames
    if abs(facts.rate_hz - fps) > 1e-6 * fps or [facts.height_px, facts.width_px] != feature["shape"][:2]:
        raise EpisodesError(f"{path}: {facts}, info.json says {feature['shape']} at {fps} Hz; {_REMEDY}")
    for before, after in pairwise(clips):
        if after[0] < before[1] - TIMESTAMP_TOLERANCE_S:
            raise EpisodesError(f"{path}: episodes {before[2]} and {after[2]} share frames; {_REMEDY}")
    if frames < round(clips[-1][1] * fps):
        raise EpisodesError(
            f"{path}: {frames} frames, episode {clips[-1][2]} ends at {round(clips[-1][1] * fps)}; {_REMEDY}"
        )
