"""Writer of MP4 files with one track of encoded pictures, and extraction of encoded pictures from an AVIF sequence.

An AVIF sequence is such a track under another brand, so that its encoder and decoder also serve for films. Sources: ISO/IEC
14496-12 (ISO base media file format), section numbers below; AV1 Codec ISO Media File Format Binding 1.2 (AOMedia).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from itertools import accumulate
from typing import BinaryIO

_CONTAINERS = frozenset({b"moov", b"trak", b"mdia", b"minf", b"stbl"})
_TICKS_A_PICTURE = 512
_IDENTITY = struct.pack(">9i", 1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30)  # of fixed-point numbers (8.2.2)
_ENGLISH_BY_NOBODY = 0x55C4  # the language "und", five bits for each letter (8.4.2.3)


@dataclass(frozen=True)
class CodedPictures:
    """Encoded pictures, the first a key frame; ``entry`` is the sample entry that describes the coding."""

    entry: bytes
    samples: tuple[bytes, ...]


def coded_pictures(sequence: bytes) -> CodedPictures:
    """Return the encoded pictures of an AVIF sequence from this process's own encoder: one track, one chunk."""
    boxes = dict(_boxes(sequence, 0, len(sequence)))
    sizes, (start,) = boxes[b"stsz"], struct.unpack_from(">I", boxes[b"stco"], 8)
    count = struct.unpack_from(">I", sizes, 8)[0]
    samples = []
    for (size,) in struct.iter_unpack(">I", sizes[12 : 12 + 4 * count]):
        samples.append(sequence[start : start + size])
        start += size
    return CodedPictures(boxes[b"stsd"][8:], tuple(samples))


def _boxes(content: bytes, start: int, end: int) -> list[tuple[bytes, bytes]]:
    """Return type and content of the boxes in a span, including those in containers."""
    found = []
    while start < end:
        size, kind = struct.unpack_from(">I4s", content, start)
        if kind in _CONTAINERS:
            found += _boxes(content, start + 8, start + size)
        else:
            found.append((kind, content[start + 8 : start + size]))
        start += size
    return found


class Mp4Track:
    """Writes the pictures of a film to a seekable stream; ``finish`` writes the index."""

    def __init__(self, stream: BinaryIO, *, width_px: int, height_px: int, rate_hz: int):
        """Begin a film; the stream is at its start, and stays open."""
        self._stream, self._shape, self._rate_hz = stream, (width_px, height_px), rate_hz
        self._entry = b""
        self._sizes: list[int] = []
        self._chunks: list[tuple[int, int]] = []
        stream.write(_box(b"ftyp", b"isom", _u32(512), b"isom", b"iso6", b"av01", b"mp41"))
        self._media_start = stream.tell()
        stream.write(struct.pack(">I4sQ", 1, b"mdat", 16))  # 64-bit size, known only at the end (4.2)

    def add(self, pictures: CodedPictures) -> None:
        """Append pictures that start with a key frame; raises ValueError if their coding differs from the previous ones."""
        if pictures.entry != (self._entry or pictures.entry):
            raise ValueError("the pictures of one track are coded in one way")
        self._entry = pictures.entry
        self._chunks.append((self._stream.tell(), len(pictures.samples)))
        self._sizes += [len(sample) for sample in pictures.samples]
        self._stream.write(b"".join(pictures.samples))

    def finish(self) -> None:
        """Complete the film, which must have at least one picture."""
        end = self._stream.tell()
        self._stream.write(self._index())
        self._stream.seek(self._media_start + 8)
        self._stream.write(struct.pack(">Q", end - self._media_start))

    def _index(self) -> bytes:
        """Return the movie box (8.2.1), without times, so that the output is deterministic."""
        (width, height), duration = self._shape, len(self._sizes) * _TICKS_A_PICTURE
        clock = _u32(0, 0, self._rate_hz * _TICKS_A_PICTURE, duration)
        track = _box(
            b"trak",
            _full(b"tkhd", _u32(0, 0, 1, 0, duration, 0, 0, 0, 0), _IDENTITY, _u32(width << 16, height << 16), flags=7),
            _box(
                b"mdia",
                _full(b"mdhd", clock, struct.pack(">HH", _ENGLISH_BY_NOBODY, 0)),
                _full(b"hdlr", _u32(0), b"vide", _u32(0, 0, 0), b"pictures\0"),
                _box(
                    b"minf",
                    _full(b"vmhd", bytes(8), flags=1),
                    _box(b"dinf", _full(b"dref", _u32(1), _full(b"url ", flags=1))),
                    self._sample_table(),
                ),
            ),
        )
        movie = _full(b"mvhd", clock, _u32(1 << 16, 1 << 24, 0, 0), _IDENTITY, bytes(24), _u32(2))
        return _box(b"moov", movie, track)

    def _sample_table(self) -> bytes:
        """Return the sample table (8.5); each chunk begins with a key frame."""
        counts = [count for _, count in self._chunks]
        runs = [(i + 1, n) for i, n in enumerate(counts) if i == 0 or n != counts[i - 1]]
        keys = [1, *(1 + before for before in accumulate(counts[:-1]))]
        return _box(
            b"stbl",
            _full(b"stsd", _u32(1), self._entry),
            _full(b"stts", _u32(1, len(self._sizes), _TICKS_A_PICTURE)),
            _full(b"stss", _u32(len(keys), *keys)),
            _full(b"stsc", _u32(len(runs)), *(_u32(first, count, 1) for first, count in runs)),
            _full(b"stsz", _u32(0, len(self._sizes), *self._sizes)),
            _full(b"co64", _u32(len(self._chunks)), *(struct.pack(">Q", start) for start, _ in self._chunks)),
        )


def as_avif_sequence(film: bytes) -> bytes:
    """Return an AV1 film under the brand that AVIF decoders expect."""
    return film[:8] + b"avis" + film[12:]


def _u32(*numbers: int) -> bytes:
    return struct.pack(f">{len(numbers)}I", *numbers)


def _box(kind: bytes, *content: bytes) -> bytes:
    body = b"".join(content)
    return _u32(8 + len(body)) + kind + body


def _full(kind: bytes, *content: bytes, flags: int = 0) -> bytes:
    """Return a box with version 0 and flags (4.2.2)."""
    return _box(kind, _u32(flags), *content)
