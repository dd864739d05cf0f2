"""Episodes as films: many in one mp4 for data sets, one as an animated picture for documents.

OpenCV's wheels bring FFmpeg under the LGPL 2.1, with two encoders that are of use in an mp4: VP9 of libvpx (BSD), and
FFmpeg's own MPEG-4 Part 2. Their settings cannot be chosen (opencv/opencv#24570): a key frame is every 12th. PyAV's wheels,
whose VP9 is 30 times as fast, bring libx264 and libx265 too, which are GPL.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Literal

import cv2
import numpy as np
from PIL import Image

from manitwin.episodes.recording import RATE_HZ
from manitwin.errors import UsageError, choose_from

Codec = Literal["vp9", "mpeg4"]
_FOURCC = {"vp9": "vp09", "mpeg4": "mp4v"}
_ENCODER = {"vp9": "FFmpeg with libvpx", "mpeg4": "FFmpeg"}
ANIMATIONS = (".webp", ".gif")


@dataclass(frozen=True)
class Span:
    """The place of an episode in its file: ``frames`` pictures from ``first_frame`` on, 20 a second."""

    file: Path
    first_frame: int
    frames: int


def require_encoder(codec: Codec) -> None:
    """Raise UsageError, naming the builds that have it, where this OpenCV cannot write a codec; nothing stands in for it."""
    fourcc = _fourcc(codec)
    with tempfile.TemporaryDirectory(prefix="manitwin-encoder-") as folder:
        writer = cv2.VideoWriter(f"{folder}/a.mp4", cv2.CAP_FFMPEG, fourcc, float(RATE_HZ), (64, 64))
        opened = writer.isOpened()
        writer.release()
    if not opened:
        others = " or ".join(f"--codec {name}" for name in _FOURCC if name != codec)
        raise UsageError(
            f"this OpenCV ({cv2.__version__}) has no encoder for {codec} ({_ENCODER[codec]}): reinstall opencv-python or"
            f" opencv-python-headless from PyPI, whose wheels bring it; builds of distributions may not. Or take {others}"
        )


def _fourcc(codec: str) -> int:
    if codec not in _FOURCC:
        raise UsageError(choose_from("video codec", codec, _FOURCC))
    return cv2.VideoWriter.fourcc(*_FOURCC[codec])


class EpisodesVideo:
    """An mp4 of episodes, one after the other, at 20 pictures a second. To be used in a ``with`` statement.

    ``vp9`` plays in browsers; ``mpeg4`` takes a hundredth of the time and half the bytes, plays in players and in what
    learning libraries decode with, and in no browser. Both are read back frame by frame exactly; same pictures, same bytes.
    The file appears when it is complete. Raises UsageError for a size that is odd, for another codec, and as
    ``require_encoder`` does.
    """

    def __init__(self, path: Path, *, width_px: int, height_px: int, codec: Codec = "vp9") -> None:
        fourcc = _fourcc(codec)
        if width_px % 2 or height_px % 2:
            raise UsageError(
                f"{path}: a video's width and height are even, not {width_px} x {height_px}; round them up"
            )
        self._path, self._shape, self._frames = path, (height_px, width_px, 3), 0
        self._unfinished = path.with_name(f".{path.stem}.{os.getpid()}.mp4")
        path.parent.mkdir(parents=True, exist_ok=True)
        self._writer = cv2.VideoWriter(
            str(self._unfinished), cv2.CAP_FFMPEG, fourcc, float(RATE_HZ), (width_px, height_px)
        )
        if not self._writer.isOpened():
            require_encoder(codec)
            raise UsageError(f"{path}: no video can be written there; check the folder and the disk")

    def __enter__(self) -> EpisodesVideo:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.release()
        if kind is None:
            self._unfinished.replace(self._path)
        else:
            self._unfinished.unlink(missing_ok=True)

    def add(self, pictures: Iterable[np.ndarray]) -> Span:
        """Append an episode's pictures ``(H, W, 3) uint8`` RGB; raises UsageError where one has another size."""
        first = self._frames
        for picture in pictures:
            if picture.shape != self._shape or picture.dtype != np.uint8:
                raise UsageError(f"{self._path}: a picture is {picture.shape} {picture.dtype}, not {self._shape} uint8")
            self._writer.write(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
            self._frames += 1
        return Span(self._path, first, self._frames - first)


def write_animation(pictures: Iterable[np.ndarray], path: Path, *, rate_hz: float = 10.0, quality: int = 70) -> None:
    """Write pictures ``(H, W, 3) uint8`` RGB as an animation that repeats, WebP or GIF by the name's suffix.

    ``quality`` (1 to 100) is WebP's; a GIF has 256 colours a picture. Raises UsageError for another suffix or no picture.
    """
    images = [Image.fromarray(picture) for picture in pictures]
    if path.suffix not in ANIMATIONS or not images:
        raise UsageError(f"{path}: an animation is a {' or '.join(ANIMATIONS)} of at least one picture")
    options: dict[str, object] = {"quality": quality, "method": 4} if path.suffix == ".webp" else {"optimize": True}
    first, rest = images[0], images[1:]
    first.save(path, save_all=True, append_images=rest, duration=round(1000 / rate_hz), loop=0, **options)  # type: ignore[arg-type]
