"""Check that the videos of a LeRobotDataset are there, and have the frames that its episodes point to."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2

from manitwin.episodes.lerobot.layout import TIMESTAMP_TOLERANCE_S, place_of
from manitwin.episodes.lerobot.videos import video_facts
from manitwin.errors import EpisodesError

_REMEDY = "write the set again"


def check_videos(root: Path, info: dict[str, Any], episodes: Sequence[dict[str, Any]], *, decode: bool) -> None:
    """Check every episode's place in every camera's files; with ``decode`` every frame is decoded.

    Raises EpisodesError for a file that is missing, of another size or rate or too short, for an episode off the grid of
    frames or longer in pictures than in rows, and for two episodes that share frames.
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
        except KeyError as error:
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
    if present != wanted or sorted(spans) != [place_of(number) for number in range(len(spans))]:
        odd = sorted(set(present) ^ set(wanted)) or wanted
        raise EpisodesError(f"{odd[0]}: the files of {key} are not those that the episodes name; {_REMEDY}")
    for path, (_, clips) in zip(wanted, sorted(spans.items()), strict=True):
        _check_file(path, feature, info["fps"], sorted(clips), decode)


def _check_file(
    path: Path, feature: dict[str, Any], fps: int, clips: list[tuple[float, float, int]], decode: bool
) -> None:
    facts = video_facts(path)
    if abs(facts.rate_hz - fps) > 1e-6 * fps or [facts.height_px, facts.width_px] != feature["shape"][:2]:
        raise EpisodesError(f"{path}: {facts}, info.json says {feature['shape']} at {fps} Hz; {_REMEDY}")
    frames = _decoded(path) if decode else facts.frames
    for before, after in pairwise(clips):
        if after[0] < before[1] - TIMESTAMP_TOLERANCE_S:
            raise EpisodesError(f"{path}: episodes {before[2]} and {after[2]} share frames; {_REMEDY}")
    if frames < round(clips[-1][1] * fps):
        raise EpisodesError(
            f"{path}: {frames} frames, episode {clips[-1][2]} ends at {round(clips[-1][1] * fps)}; {_REMEDY}"
        )


def _decoded(path: Path) -> int:
    capture = cv2.VideoCapture(str(path))
    frames = 0
    while capture.read()[0]:
        frames += 1
    capture.release()
    return frames
