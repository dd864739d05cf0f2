"""Video writers for episodes: many in one mp4 for data sets, one as an animated image for documents."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np
from PIL import Image

from manitwin.episodes.recording import RATE_HZ
from manitwin.episodes.video_encoders import CODECS, Codec, missing_encoder, open_encoder
from manitwin.errors import UsageError, unknown_name_message

ANIMATIONS = (".webp", ".gif")


@dataclass(frozen=True)
class Span:
    """Location of an episode in its file: ``frames`` pictures from ``first_frame``."""

    file: Path
    first_frame: int
    frames: int


def require_encoder(codec: Codec) -> None:
    """Raise UsageError, naming suitable builds, if a codec cannot be encoded here; there is no fallback."""
    _require_codec(codec)
    with tempfile.TemporaryDirectory(prefix="manitwin-encoder-") as folder:
        encoder = open_encoder(codec, Path(folder) / "a.mp4", 64, 64, RATE_HZ)
        if encoder is None:
            raise missing_encoder(codec)
        encoder.write(np.zeros((64, 64, 3), np.uint8))
        encoder.close()


def _require_codec(codec: str) -> None:
    if codec not in CODECS:
        raise UsageError(unknown_name_message("video codec", codec, CODECS))


class VideoWriter:
    """An mp4 of consecutive episodes at ``rate_hz`` pictures per second. Use it in a ``with`` statement.

    ``av1`` and ``vp9`` play in browsers; ``vp9`` takes ten times as long, and also plays in older ones. ``mpeg4`` takes a
    fifth of the time of ``av1``, and plays in the decoders of learning libraries, but in no browser. All are decoded frame by
    frame exactly, and encoded deterministically. The file appears when it is complete. Raises UsageError for an odd size, an
    unknown codec, and as ``require_encoder`` does.
    """

    def __init__(
        self, path: Path, *, width_px: int, height_px: int, codec: Codec = "av1", rate_hz: int = RATE_HZ
    ) -> None:
        _require_codec(codec)
        if width_px % 2 or height_px % 2:
            raise UsageError(
                f"{path}: a video's width and height are even, not {width_px} x {height_px}; round them up"
            )
        self._path, self._shape, self._frames = path, (height_px, width_px, 3), 0
        self._unfinished = path.with_name(f".{path.stem}.{os.getpid()}.mp4")
        path.parent.mkdir(parents=True, exist_ok=True)
        encoder = open_encoder(codec, self._unfinished, width_px, height_px, rate_hz)
        if encoder is None:
            require_encoder(codec)
            raise UsageError(f"{path}: no video can be written there; check the folder and the disk")
        self._encoder = encoder

    def __enter__(self) -> VideoWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._encoder.close()
            if kind is None:
                self._unfinished.replace(self._path)
        finally:
            self._unfinished.unlink(missing_ok=True)

    def add(self, pictures: Iterable[np.ndarray]) -> Span:
        """Append an episode's pictures ``(H, W, 3) uint8`` RGB; raises UsageError for a picture of another size."""
        first = self._frames
        for picture in pictures:
            if picture.shape != self._shape or picture.dtype != np.uint8:
                raise UsageError(f"{self._path}: a picture is {picture.shape} {picture.dtype}, not {self._shape} uint8")
            self._encoder.write(picture)
            self._frames += 1
        return Span(self._path, first, self._frames - first)


def write_animation(pictures: Iterable[np.ndarray], path: Path, *, rate_hz: float = 10.0, quality: int = 70) -> None:
    """Write pictures ``(H, W, 3) uint8`` RGB as a looping animation, WebP or GIF by the file's suffix.

    ``quality`` (1 to 100) applies to WebP; a GIF has 256 colours per picture. Raises UsageError for another suffix or no
    picture.
    """
    images = [Image.fromarray(picture) for picture in pictures]
    if path.suffix not in ANIMATIONS or not images:
        raise UsageError(f"{path}: an animation is a {' or '.join(ANIMATIONS)} of at least one picture")
    options: dict[str, object] = {"quality": quality, "method": 4} if path.suffix == ".webp" else {"optimize": True}
    first, rest = images[0], images[1:]
    first.save(path, save_all=True, append_images=rest, duration=round(1000 / rate_hz), loop=0, **options)  # type: ignore[arg-type]
