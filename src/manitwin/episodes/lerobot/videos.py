"""Pictures of a camera as LeRobot takes them: several episodes in one mp4, each at its own frames."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from manitwin.episodes.lerobot.feature_statistics import Statistics
from manitwin.episodes.lerobot.lerobot_format import CODEC, QUANTILES, VIDEO_PATH, place_of, video_key
from manitwin.episodes.recording import RATE_HZ
from manitwin.errors import EpisodesError
from manitwin.formats.bounded_file import open_regular, with_remedy

_CODECS = {
    **dict.fromkeys(("avc1", "h264", "H264", "AVC1"), "h264"),
    **dict.fromkeys(("vp09", "VP90", "vp90"), "vp9"),
    **dict.fromkeys(("av01", "AV01"), "av1"),
    **dict.fromkeys(("mp4v", "FMP4", "MP4V"), "mpeg4"),
    **dict.fromkeys(("hev1", "hvc1", "hevc"), "hevc"),
}
_ENCODED_BY_LEROBOT = ("av1", "h264", "hevc")
_SAMPLED_FRAMES = 50
"""Of an episode's pictures so many at most are looked at for statistics (lerobot: 100)."""

_PIXEL_STEP = 4
MAX_SIDE_PX = 8192
_REMEDY = "render the pictures again"


@dataclass(frozen=True)
class Clip:
    """The place of an episode's pictures: frame ``first_frame + t`` of an mp4 of 20 frames a second shows state t."""

    file: Path
    first_frame: int = 0


@dataclass(frozen=True)
class CameraVideos:
    """A camera's pictures of episodes, by ``episode_id``; all of one size and codec. ``pinhole``: see ``NamedCamera.to_json``."""

    camera: str
    clips: Mapping[str, Clip]
    pinhole: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class VideoFacts:
    """The size, rate, codec and number of frames that an mp4 states."""

    frames: int
    rate_hz: float
    height_px: int
    width_px: int
    codec: str


def opened_film(path: Path) -> cv2.VideoCapture:
    """Open an mp4 for decoding; raises EpisodesError for what is none.

    FFmpeg goes by a file's content: what is a list of other files' names to it is not given to it.
    """
    with open_regular(path, with_remedy(EpisodesError, _REMEDY), inside=path.parent, name=str(path)) as stream:
        head = stream.read(8)
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG) if head[4:] == b"ftyp" else None
    if capture is None or not capture.isOpened():
        raise EpisodesError(f"{path}: no video that can be read; {_REMEDY}")
    return capture


def video_facts(path: Path) -> VideoFacts:
    """Read the header of a video; raises EpisodesError for a file that is no video."""
    capture = opened_film(path)
    try:
        code = int(capture.get(cv2.CAP_PROP_FOURCC))
        name = "".join(chr((code >> 8 * i) & 255) for i in range(4))
        height_px, width_px = (int(capture.get(each)) for each in (cv2.CAP_PROP_FRAME_HEIGHT, cv2.CAP_PROP_FRAME_WIDTH))
        if not (0 < height_px <= MAX_SIDE_PX and 0 < width_px <= MAX_SIDE_PX):
            raise EpisodesError(f"{path}: pictures of {width_px} x {height_px} pixels; {_REMEDY}")
        return VideoFacts(
            frames=int(capture.get(cv2.CAP_PROP_FRAME_COUNT)),
            rate_hz=float(capture.get(cv2.CAP_PROP_FPS)),
            height_px=height_px,
            width_px=width_px,
            codec=_CODECS.get(name, name.strip("\0 ").lower()),
        )
    finally:
        capture.release()


def frames_of(path: Path) -> Iterator[np.ndarray]:
    """Yield a film's pictures, ``(height, width, 3) uint8`` BGR, as far as it can be decoded."""
    capture = opened_film(path)
    try:
        while (picture := capture.read()[1]) is not None:
            yield picture
    finally:
        capture.release()


class VideoColumns:
    """Copies a camera's files into a set, in the order in which episodes use them, and tells where each episode is."""

    def __init__(self, videos: CameraVideos, root: Path):
        self.videos, self.root, self.key = videos, root, video_key(videos.camera)
        self.numbers: dict[Path, int] = {}
        self.facts: VideoFacts | None = None
        self._frames: dict[Path, int] = {}
        self._reader = _ClipReader()

    def row(self, episode_id: str, steps: int) -> tuple[dict[str, Any], Statistics]:
        """Return an episode's columns, and the statistics of its pictures.

        Raises EpisodesError where there are no pictures of it, or not of all its steps, or of another size or rate.
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
        chunk, place = place_of(number)
        prefix = f"videos/{self.key}"
        columns = {
            f"{prefix}/chunk_index": chunk,
            f"{prefix}/file_index": place,
            f"{prefix}/from_timestamp": clip.first_frame / RATE_HZ,
            f"{prefix}/to_timestamp": (clip.first_frame + steps) / RATE_HZ,
        }
        return columns, self._reader.statistics(clip, steps)

    @property
    def info(self) -> dict[str, Any]:
        """The entry of info.json.

        ``video.codec`` is there only of codecs that LeRobot encodes with: its tools (0.6) take it for what they cut, and split
        no set and delete no episode where it is another one. Without it they take their default, AV1.
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
                "video.fps": RATE_HZ,
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
        if abs(facts.rate_hz - RATE_HZ) > 1e-6 * RATE_HZ:
            raise EpisodesError(f"{file}: {facts.rate_hz:g} frames a second, not {RATE_HZ}; render the pictures again")
        if (facts.height_px, facts.width_px, facts.codec) != (first.height_px, first.width_px, first.codec):
            raise EpisodesError(f"{file}: {facts} differs from the camera's other files, {first}; render them alike")
        number = len(self.numbers)
        chunk, place = place_of(number)
        target = self.root / VIDEO_PATH.format(video_key=self.key, chunk_index=chunk, file_index=place)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, target)
        self.numbers[file], self._frames[file], self.facts = number, facts.frames, first
        return number


class _ClipReader:
    """Decodes clips; those of one file in their order need one pass."""

    def __init__(self) -> None:
        self._file: Path | None = None
        self._capture: Any = None
        self._next = 0

    def statistics(self, clip: Clip, steps: int) -> Statistics:
        """Return the statistics ``(3, 1, 1)`` of an episode's pictures, RGB between 0 and 1."""
        step = -(-steps // _SAMPLED_FRAMES)
        pictures = [self._picture(clip.file, clip.first_frame + t) for t in range(0, steps, step)]
        pixels = np.concatenate([p[::_PIXEL_STEP, ::_PIXEL_STEP, ::-1].reshape(-1, 3) for p in pictures]) / 255.0
        rows = {
            "min": pixels.min(0),
            "max": pixels.max(0),
            "mean": pixels.mean(0),
            "std": pixels.std(0),
            **dict(zip(QUANTILES, np.quantile(pixels, list(QUANTILES.values()), axis=0), strict=True)),
        }
        return {"count": [len(pictures)], **{name: row.reshape(3, 1, 1).tolist() for name, row in rows.items()}}

    def _picture(self, file: Path, frame: int) -> np.ndarray:
        if self._file != file or frame < self._next:
            if self._capture is not None:
                self._capture.release()
            self._file, self._capture, self._next = file, opened_film(file), 0
        while self._next < frame and self._capture.grab():
            self._next += 1
        read, picture = self._capture.read()
        if not read or self._next != frame:
            raise EpisodesError(f"{file}: frame {frame} cannot be decoded; render the pictures again")
        self._next += 1
        decoded: np.ndarray = picture
        return decoded
