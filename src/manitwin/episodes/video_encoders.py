"""Video encoders for mp4: AV1 of Pillow's libavif and libaom (BSD), VP9 and MPEG-4 Part 2 of OpenCV's FFmpeg (LGPL).

OpenCV cannot set encoder options (opencv/opencv#24570), and libvpx's defaults are slow. PyAV's wheels contain libx264 and
libx265, which are GPL.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Literal, Protocol, get_args

import cv2
import numpy as np
from PIL import Image, features

from manitwin.errors import UsageError
from manitwin.formats.mp4_file import CodedPictures, Mp4Track, coded_pictures

Codec = Literal["av1", "vp9", "mpeg4"]
CODECS: tuple[str, ...] = get_args(Codec)
_FOURCC = {"vp9": "vp09", "mpeg4": "mp4v"}
_NO_ENCODER = {
    "av1": f"Pillow ({Image.__version__}) has no encoder for av1 (libavif with libaom): reinstall pillow",
    "vp9": f"OpenCV ({cv2.__version__}) has no encoder for vp9 (FFmpeg with libvpx): reinstall opencv-python or"
    " opencv-python-headless",
    "mpeg4": f"OpenCV ({cv2.__version__}) has no encoder for mpeg4 (FFmpeg): reinstall opencv-python or opencv-python-headless",
}

_GROUP_PICTURES = 12
"""Pictures per group, from one independently decodable picture to the next: a trade-off of random access time and size."""

_QUALITY = 80
_SPEED = 9  # libavif's speed, 0 to 10; here libaom's real-time mode
_CPU_USED = "11"
"""libaom's fastest mode: two thirds of the time of libavif's fastest speed, 5 % more bytes, 0.2 dB less."""


class Encoder(Protocol):
    """Encodes pictures ``(H, W, 3) uint8`` RGB of one size; ``close`` writes the remaining ones."""

    def write(self, picture: np.ndarray) -> None: ...

    def close(self) -> None: ...


def missing_encoder(codec: Codec) -> UsageError:
    """Return the error for an installation without a codec's encoder, naming builds that have it."""
    others = " or ".join(f"--codec {name}" for name in CODECS if name != codec)
    return UsageError(
        f"this {_NO_ENCODER[codec]} from PyPI, whose wheels bring it; builds of distributions may not. Or take {others}"
    )


def open_encoder(codec: Codec, path: Path, width_px: int, height_px: int, rate_hz: int) -> Encoder | None:
    """Start a video; None if the file cannot be written, or if this installation has no encoder for the codec."""
    if codec == "av1":
        try:
            return _Av1(path, width_px, height_px, rate_hz) if features.check("avif") else None
        except OSError:
            return None
    writer = cv2.VideoWriter(
        str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*_FOURCC[codec]), float(rate_hz), (width_px, height_px)
    )
    return _OpenCV(writer) if writer.isOpened() else None


class _OpenCV:
    def __init__(self, writer: cv2.VideoWriter):
        self._writer = writer

    def write(self, picture: np.ndarray) -> None:
        self._writer.write(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))

    def close(self) -> None:
        self._writer.release()


class _Av1:
    """Encodes groups of pictures as AVIF sequences, and concatenates them into one track."""

    def __init__(self, path: Path, width_px: int, height_px: int, rate_hz: int):
        self._stream = path.open("wb")
        self._track = Mp4Track(self._stream, width_px=width_px, height_px=height_px, rate_hz=rate_hz)
        self._group: list[Image.Image] = []

    def write(self, picture: np.ndarray) -> None:
        self._group.append(Image.fromarray(picture))
        if len(self._group) == _GROUP_PICTURES:
            self._code()

    def close(self) -> None:
        with self._stream:
            if self._group:
                self._code()
            self._track.finish()

    def _code(self) -> None:
        first, *rest = self._group
        # A single picture would be coded as a still image, which is another kind of track: it is coded twice, and one is used.
        alone = not rest
        coded = io.BytesIO()
        first.save(
            coded,
            format="AVIF",
            save_all=True,
            append_images=[first] if alone else rest,
            quality=_QUALITY,
            speed=_SPEED,
            codec="aom",
            advanced={"cpu-used": _CPU_USED},
            subsampling="4:2:0",
            range="limited",  # the default of players if the range is not stated
            max_threads=1,
        )
        pictures = coded_pictures(coded.getvalue())
        self._track.add(CodedPictures(pictures.entry, pictures.samples[:1]) if alone else pictures)
        self._group = []
