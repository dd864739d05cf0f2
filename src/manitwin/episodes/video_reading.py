"""Video decoding frame by frame: by OpenCV, and for AV1, which its wheels cannot decode, by Pillow's libavif."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import cv2
import numpy as np
from PIL import Image

from manitwin.errors import EpisodesError
from manitwin.formats.bounded_file import open_regular, read_bytes, with_remedy
from manitwin.formats.mp4_file import as_avif_sequence

MAX_SIDE_PX = 8192
_MAX_BYTES = 2**30
_CODECS = {
    **dict.fromkeys(("avc1", "h264", "H264", "AVC1"), "h264"),
    **dict.fromkeys(("vp09", "VP90", "vp90"), "vp9"),
    **dict.fromkeys(("av01", "AV01"), "av1"),
    **dict.fromkeys(("mp4v", "FMP4", "MP4V"), "mpeg4"),
    **dict.fromkeys(("hev1", "hvc1", "hevc"), "hevc"),
}
_REMEDY = "render the pictures again"
_refused = with_remedy(EpisodesError, _REMEDY)


@dataclass(frozen=True)
class VideoFacts:
    """Size, rate, codec and number of frames according to an mp4's header."""

    frames: int
    rate_hz: float
    height_px: int
    width_px: int
    codec: str


class VideoReader:
    """Pictures of an mp4, ``(H, W, 3) uint8`` RGB, in sequence or by number. Use it in a ``with`` statement.

    Raises EpisodesError for a file that is not a video. Only mp4 content is passed to FFmpeg, which would otherwise follow
    playlists to other files.
    """

    def __init__(self, path: Path):
        self._path = path
        with open_regular(path, _refused, inside=path.parent, name=str(path)) as stream:
            head = stream.read(8)
        capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG) if head[4:] == b"ftyp" else None
        if capture is None or not capture.isOpened():
            raise EpisodesError(f"{path}: not a readable video; {_REMEDY}")
        self._capture, self._next = capture, 0
        self._sequence: Image.Image | None = None
        try:
            self.facts = _read_header(path, capture)
            if self.facts.codec == "av1":
                self._sequence = _sequence(path, self.facts)
        except BaseException:
            capture.release()
            raise

    def __enter__(self) -> VideoReader:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._capture.release()
        if self._sequence is not None:
            self._sequence.close()

    def __iter__(self) -> Iterator[np.ndarray]:
        """Yield the pictures until one cannot be decoded."""
        frame = 0
        while (picture := self._decoded(frame)) is not None:
            yield picture
            frame += 1

    def picture(self, frame: int) -> np.ndarray:
        """Return a picture by number, fastest in increasing order; raises EpisodesError if it cannot be decoded."""
        picture = self._decoded(frame)
        if picture is None:
            raise EpisodesError(f"{self._path}: frame {frame} cannot be decoded; {_REMEDY}")
        return picture

    def _decoded(self, frame: int) -> np.ndarray | None:
        return self._captured(frame) if self._sequence is None else _sought(self._sequence, frame)

    def _captured(self, frame: int) -> np.ndarray | None:
        if frame < self._next:
            self._capture.release()
            self._capture, self._next = cv2.VideoCapture(str(self._path), cv2.CAP_FFMPEG), 0
        while self._next < frame and self._capture.grab():
            self._next += 1
        read, picture = self._capture.read()
        if not read or self._next != frame:
            return None
        self._next += 1
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))


def video_facts(path: Path) -> VideoFacts:
    """Read the header of a video; raises EpisodesError for a file that is not a video."""
    with VideoReader(path) as film:
        return film.facts


def _read_header(path: Path, capture: cv2.VideoCapture) -> VideoFacts:
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


def _sequence(path: Path, facts: VideoFacts) -> Image.Image:
    content = read_bytes(path, _MAX_BYTES, _refused, inside=path.parent, name=str(path))
    try:
        sequence = Image.open(io.BytesIO(as_avif_sequence(content)), formats=["AVIF"])
    except Exception as error:  # decoders raise arbitrary exceptions on damaged data
        raise EpisodesError(f"{path}: not a readable AV1 video; {_REMEDY}") from error
    if sequence.size != (facts.width_px, facts.height_px):
        raise EpisodesError(
            f"{path}: pictures of {sequence.size} pixels, its header says {facts.width_px} x {facts.height_px}; {_REMEDY}"
        )
    return sequence


def _sought(sequence: Image.Image, frame: int) -> np.ndarray | None:
    try:
        sequence.seek(frame)
        return np.asarray(sequence.convert("RGB"))
    except Exception:  # beyond the end, or damaged data; the caller reports the frame number
        return None
