"""Number of pictures in a file, counted in one pass up to a limit; decoders could take hours."""

from __future__ import annotations

import struct
from typing import BinaryIO

MAX_PICTURES = 10_000
_MAX_BLOCKS = 5_000_000  # of a GIF, with at most 255 bytes each
_GIF_EXTENSION, _GIF_IMAGE = 0x21, 0x2C  # GIF89a specification, sections 20 and 23 to 26


def count_pictures(stream: BinaryIO, format: str) -> int | None:
    """Return the number of pictures in a GIF or TIFF, at most ``MAX_PICTURES`` + 1; None for other or broken files.

    The stream position is restored.
    """
    counted = {"gif": _gif_images, "tiff": _tiff_directories}.get(format)
    if counted is None:
        return None
    place = stream.tell()
    try:
        stream.seek(0)
        return counted(stream)
    except (struct.error, IndexError, OSError, OverflowError):  # truncated: the decoder reports it
        return None
    finally:
        stream.seek(place)


def _tiff_directories(stream: BinaryIO) -> int:
    """Count the image file directories of a TIFF (TIFF 6.0, section 2); a cyclic chain is counted once."""
    order = "<" if stream.read(4)[:2] == b"II" else ">"
    count = 0
    (offset,) = struct.unpack(f"{order}I", stream.read(4))
    seen: set[int] = set()
    while offset and offset not in seen and count <= MAX_PICTURES:
        seen.add(offset)
        stream.seek(offset)
        (entries,) = struct.unpack(f"{order}H", stream.read(2))
        stream.seek(12 * entries, 1)
        (offset,) = struct.unpack(f"{order}I", stream.read(4))
        count += 1
    return count


def _gif_images(stream: BinaryIO) -> int:
    """Count the image descriptors of a GIF up to the last complete block."""
    screen = stream.read(13)
    stream.seek(_color_table_bytes(screen[10]), 1)
    images = blocks = 0
    while images <= MAX_PICTURES and (kind := stream.read(1)):
        if kind[0] == _GIF_IMAGE:
            descriptor = stream.read(9)
            stream.seek(_color_table_bytes(descriptor[8]) + 1, 1)  # and the LZW code size
            images += 1
        elif kind[0] == _GIF_EXTENSION:
            stream.seek(1, 1)
        else:
            break
        while size := stream.read(1)[0]:
            stream.seek(size, 1)
            blocks += 1
            if blocks > _MAX_BLOCKS:
                return MAX_PICTURES + 1
    return images


def _color_table_bytes(packed: int) -> int:
    return 3 << ((packed & 7) + 1) if packed & 0x80 else 0
