"""Pictures that ask for more than there is: a reason in one line, before anything is decoded."""

import io
import os
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from manitwin.errors import InputError
from manitwin.formats.image_file import check_header, read_image
from manitwin.formats.image_frames import MAX_PICTURES, count_pictures
from manitwin.formats.sniff import sniff


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(width: int, height: int, *, depth: int = 8, color: int = 2, extra: bytes = b"") -> bytes:
    channels = {0: 1, 2: 3, 6: 4}[color]
    packer = zlib.compressobj(1)
    row = bytes(1 + width * channels * depth // 8)
    pixels = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + extra + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


def gif(*blocks: bytes, width: int = 64, height: int = 64) -> bytes:
    return b"GIF89a" + struct.pack("<HH", width, height) + b"\0\0\0" + b"".join(blocks) + b";"


PICTURE = b"\x2c" + struct.pack("<HHHH", 0, 0, 64, 64) + b"\0\2\2L\1\0"
WEBP = (b"VP8X" + struct.pack("<I", 10) + b"\x02\0\0\0" + (16382).to_bytes(3, "little") * 2 + b"ANIM"
        + struct.pack("<I", 6) + bytes(6) + b"ANMF" + struct.pack("<I", 16) + bytes(60))  # fmt: skip
BMP = struct.pack("<IiiHHIIiiII", 40, 15000, 17000, 1, 8, 1, 0, 0, 0, 256, 0) + bytes(1024)
TIFF = struct.pack("<H", 2) + struct.pack("<HHII", 256, 4, 1, 2**31) + struct.pack("<HHII", 257, 4, 1, 2**31)
BOMB = chunk(b"iCCP", b"x\0\0" + zlib.compress(bytes(50_000_000), 9))
REFUSED: list[tuple[str, Callable[[], bytes], str, str]] = [
    ("header.png", lambda: png(64, 64)[:8] + chunk(b"IHDR", struct.pack(">IIBBBBB", 14_000, 14_000, 8, 6, 0, 0, 0))
     + png(64, 64)[33:], "too_large", "megapixels"),
    ("thin.png", lambda: png(100_000, 33), "too_small", "leave 1 on its shorter side"),
    ("tall.png", lambda: png(33, 100_000), "too_small", "crop it"),
    ("profile.png", lambda: png(64, 64, extra=BOMB), "unreadable", "too large"),
    ("texts.png", lambda: png(64, 64, extra=chunk(b"tEXt", b"k\0" + b"a" * 1000) * 70_000), "unreadable", "text chunks"),
    ("canvas.webp", lambda: b"RIFF" + struct.pack("<I", 100) + b"WEBP" + WEBP, "too_large", "megapixels"),
    ("canvas.gif", lambda: gif(PICTURE, width=65535, height=65535), "too_large", "megapixels"),
    ("frames.gif", lambda: gif(PICTURE * 20_000), "too_large", "pictures in one file"),
    ("comment.gif", lambda: gif(b"\x21\xfe" + b"\1a" * 5_100_000 + b"\0" + PICTURE), "too_large", "pictures in one file"),
    ("rle.bmp", lambda: b"BM" + struct.pack("<IHHI", 1078, 0, 0, 1078) + BMP, "too_large", "megapixels"),
    ("size.tiff", lambda: b"II*\0\x08\0\0\0" + TIFF + bytes(4), "unreadable", "corrupt"),
    ("pages.tiff", lambda: b"II*\0\x08\0\0\0" + b"".join(struct.pack("<HI", 0, 14 + 6 * i) for i in range(20_000)),
     "too_large", "pictures in one file"),
    ("random.avif", lambda: b"\0\0\0\x1cftypavif\0\0\0\0avifmif1miaf" + bytes(range(256)) * 10, "unreadable", "corrupt"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "content", "reason", "said"), REFUSED, ids=[case[0] for case in REFUSED])
def test_a_picture_that_asks_for_too_much_is_refused_in_one_line(
    tmp_path: Path, name: str, content: Callable[[], bytes], reason: str, said: str
) -> None:
    (tmp_path / name).write_bytes(content())
    assert sniff(tmp_path / name).kind == "image"
    with pytest.raises(InputError) as caught:
        read_image(tmp_path / name, max_side_px=2048)
    assert caught.value.reason == reason and said in caught.value.detail
    assert caught.value.detail.startswith(f"{name}: ") and caught.value.detail.isprintable()


def test_a_sparse_picture_is_refused_by_its_size(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(png(64, 64))
    os.truncate(tmp_path / "a.png", 6 << 30)
    for read in (read_image, check_header):
        with pytest.raises(InputError, match=r"^too_large: a\.png: 6442450944 bytes exceed the limit"):
            read(tmp_path / "a.png")


def test_a_pipe_is_no_picture(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.png")
    with pytest.raises(InputError, match=r"^unreadable: a\.png: is a named pipe"):
        sniff(tmp_path / "a.png")


def test_what_passes_the_processs_memory_is_too_large_in_one_line(tmp_path: Path) -> None:
    """In a process of 1.5 GB: 169 megapixels of 16 bits, which are within the limit of pixels."""
    (tmp_path / "a.png").write_bytes(png(13_000, 13_000, depth=16, color=0))
    program = (
        "import resource; from pathlib import Path\n"
        "from manitwin.errors import InputError; from manitwin.formats.image_file import read_image\n"
        "resource.setrlimit(resource.RLIMIT_AS, (3 << 29, 3 << 29))\n"
        "try: read_image(Path('a.png'), max_side_px=2048)\n"
        "except InputError as error: print(error)\n"
    )
    said = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert (said.returncode, said.stderr) == (0, "")
    assert said.stdout == "too_large: a.png: it needs more memory than is available; scale the picture down first\n"


def test_pictures_of_a_file_are_counted_without_decoding_them(tmp_path: Path) -> None:
    frames = [Image.fromarray(np.full((40, 50), 50 * i, np.uint8)) for i in range(5)]
    for format in ("gif", "tiff"):
        stream = io.BytesIO()
        frames[0].save(stream, format, save_all=True, append_images=frames[1:])
        assert count_pictures(stream, format) == 5
        stream.seek(7)
        assert count_pictures(stream, format) == 5 and stream.tell() == 7
    assert count_pictures(io.BytesIO(gif(PICTURE * (MAX_PICTURES + 5))), "gif") == MAX_PICTURES + 1
    assert count_pictures(io.BytesIO(b"II*\0\x08\0\0\0\0\0\x08\0\0\0"), "tiff") == 1
    assert count_pictures(io.BytesIO(b"GIF89a"), "gif") is None and count_pictures(io.BytesIO(b""), "png") is None
