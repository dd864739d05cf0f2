"""Videos of a LeRobotDataset: several episodes in one mp4, each with its own range of frames."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.episodes.lerobot.feature_statistics import Statistics
from manitwin.episodes.lerobot.lerobot_format import CODEC, QUANTILES, VIDEO_PATH, chunk_and_file, video_key
from manitwin.episodes.video_reading import VideoFacts, VideoReader, video_facts
from manitwin.errors import EpisodesError

_ENCODED_BY_LEROBOT = ("av1", "h264", "hevc")
_SAMPLED_FRAMES = 50
"""Largest number of pictures per episode sampled for statistics (lerobot: 100)."""

_PIXEL_STEP = 4


@dataclass(frozen=True)
class Clip:
    """Location of an episode's pictures: frame ``first_frame + t`` of an mp4 shows state t at the set's rate."""

    file: Path
    first_frame: int = 0


@dataclass(frozen=True)
class CameraVideos:
    """A camera's clips by ``episode_id``, all of one size and codec; for ``pinhole`` see ``NamedCamera.to_json``."""

    camera: str
    clips: Mapping[str, Clip]
    pinhole: Mapping[str, Any] = field(default_factory=dict)


class VideoColumns:
    """Copies a camera's files into a set, in order of first use, and returns each episode's location."""

    def __init__(self, videos: CameraVideos, root: Path, rate_hz: int):
        self.videos, self.root, self.key, self._rate_hz = videos, root, video_key(videos.camera), rate_hz
        self.numbers: dict[Path, int] = {}
        self.facts: VideoFacts | None = None
        self._frames: dict[Path, int] = {}
        self._reader = _ClipReader()

    def row(self, episode_id: str, steps: int) -> tuple[dict[str, Any], Statistics]:
        """Return an episode's video columns, and the statistics of its pictures.

        Raises EpisodesError if pictures are missing or incomplete, or have another size or rate.
        """
        clip = self.videos.clips.get(episode_id)
        if clip is None:
            raise EpisodesError(
                f"episode {episode_id}: no pictures of camera {self.videos.camera!r}; render it, or leave it out"
            )
        number = self._copied(clip.file)
        if clip.first_frame < 0 or clip.first_frame + steps > self._frames[clip.file]:
            raise EpisodesError(
                f"{clip.file}: {self._frames[clip.file]} frames, but episode {episode_id} is at {clip.first_frame} and has"
                f" {steps}; render the pictures again"
            )
        chunk, place = chunk_and_file(number)
        prefix = f"videos/{self.key}"
        columns = {
            f"{prefix}/chunk_index": chunk,
            f"{prefix}/file_index": place,
            f"{prefix}/from_timestamp": clip.first_frame / self._rate_hz,
            f"{prefix}/to_timestamp": (clip.first_frame + steps) / self._rate_hz,
        }
        return columns, self._reader.statistics(clip, steps)

    @property
    def info(self) -> dict[str, Any]:
        """Entry of info.json.

        ``video.codec`` is only set for codecs that LeRobot can encode: its tools (0.6) encode with this codec when they split
        a set or delete an episode, and fail for another one. Without the entry they use their default, AV1.
        """
        assert self.facts is not None  # a set has at least one episode, and each has a clip
        facts = self.facts
        return {
            "dtype": "video",
            "shape": [facts.height_px, facts.width_px, 3],
            "names": ["height", "width", "channels"],
            "info": {
                "video.height": facts.height_px,
                "video.width": facts.width_px,
                "video.pix_fmt": "yuv420p",
                "video.is_depth_map": False,
                "video.fps": self._rate_hz,
                "video.channels": 3,
                "has_audio": False,
                CODEC: facts.codec,
                **({"video.codec": facts.codec} if facts.codec in _ENCODED_BY_LEROBOT else {}),
                **self.videos.pinhole,
            },
        }

    def _copied(self, file: Path) -> int:
        if file in self.numbers:
            return self.numbers[file]
        facts = video_facts(file)
        first = self.facts or facts
        if abs(facts.rate_hz - self._rate_hz) > 1e-6 * self._rate_hz:
            raise EpisodesError(
                f"{file}: {facts.rate_hz:g} frames a second, not {self._rate_hz}; render the pictures again"
            )
        if (facts.height_px, facts.width_px, facts.codec) != (first.height_px, first.width_px, first.codec):
            raise EpisodesError(f"{file}: {facts} differs from the camera's other files, {first}; render them alike")
        number = len(self.numbers)
        chunk, place = chunk_and_file(number)
        target = self.root / VIDEO_PATH.format(video_key=self.key, chunk_index=chunk, file_index=place)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, target)
        self.numbers[file], self._frames[file], self.facts = number, facts.frames, first
        return number


class _ClipReader:
    """Decodes clips; clips of one file in order need a single pass."""

    def __init__(self) -> None:
        self._file: Path | None = None
        self._film: VideoReader | None = None

    def statistics(self, clip: Clip, steps: int) -> Statistics:
        """Return the statistics ``(3, 1, 1)`` of an episode's pictures, RGB between 0 and 1."""
        step = -(-steps // _SAMPLED_FRAMES)
        film = self._opened(clip.file)
        pictures = [film.picture(clip.first_frame + t) for t in range(0, steps, step)]
        pixels = np.concatenate([p[::_PIXEL_STEP, ::_PIXEL_STEP].reshape(-1, 3) for p in pictures]) / 255.0
        rows = {
            "min": pixels.min(0),
            "max": pixels.max(0),
            "mean": pixels.mean(0),
            "std": pixels.std(0),
            **dict(zip(QUANTILES, np.quantile(pixels, list(QUANTILES.values()), axis=0), strict=True)),
        }
        return {"count": [len(pictures)], **{name: row.reshape(3, 1, 1).tolist() for name, row in rows.items()}}

    def _opened(self, file: Path) -> VideoReader:
        if self._film is None or self._file != file:
            if self._film is not None:
                self._film.close()
            self._file, self._film = file, VideoReader(file)
        return self._film
