"""Mutations of plain bytes and of lines of text."""

from __future__ import annotations

import re
import struct
from random import Random

from fuzz_numbers import INTEGERS, NUMBERS, TEXTS

_DEEP, _MANY = 100_000, 20_000
MOST_BYTES = 16 << 20


def mutate_bytes(content: bytes, rng: Random) -> bytes:
    """Change integers, bits or blocks; more often near the beginning, where headers are."""
    data = bytearray(content)
    size = len(data)
    if size == 0:
        return bytes(rng.randrange(256) for _ in range(rng.choice((1, 4, 84, 1000))))
    at = rng.randrange(size) if rng.random() < 0.5 else rng.randrange(min(size, rng.choice((16, 64, 256, 4096))))
    end = min(size, at + rng.choice((1, 2, 4, 8, 16, 64, 512, size)))
    kind = rng.randrange(9)
    if kind <= 2:
        width = rng.choice((1, 2, 4, 4, 8))
        value = rng.choice(INTEGERS) & ((1 << 8 * width) - 1)
        data[at : at + width] = value.to_bytes(width, rng.choice(("little", "big")))
    elif kind == 3:
        for _ in range(rng.choice((1, 1, 3, 30))):
            data[rng.randrange(size)] ^= 1 << rng.randrange(8)
    elif kind == 4:
        del data[at:]
    elif kind == 5:
        del data[at:end]
    elif kind == 6:
        data[at:at] = data[at:end] * rng.choice((1, 2, 50))
    elif kind == 7:
        data[at:end] = bytes([rng.choice((0, 0xFF, 0x20, 0x80))]) * (end - at)
    else:
        data[at : at + 8] = struct.pack(
            rng.choice(("<f", "<d", ">d")), rng.choice((float("nan"), float("inf"), 1e30, -1e38, 1e-40))
        )
    return bytes(data)


def spliced(content: bytes, other: bytes, rng: Random) -> bytes:
    return content[: rng.randrange(len(content) + 1)] + other[rng.randrange(len(other) + 1) :]


def mutate_text(content: bytes, rng: Random) -> bytes:
    """Change numbers, words, lines, quotes or the encoding of a text."""
    text = content.decode("utf-8", "surrogateescape")
    kind = rng.randrange(12)
    if kind <= 3:
        text = replaced(text, r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?", rng.choice(NUMBERS), rng)
    elif kind <= 5:
        text = replaced(text, r"[^\s\"'<>=,;(){}\[\]]+", rng.choice((*TEXTS, *NUMBERS)), rng)
    elif kind <= 9:
        text = _lines_changed(text, rng)
    elif kind == 10:
        at = rng.randrange(len(text) + 1)
        long = rng.choice(
            (" ", "\n", "\t", "a", "0", '"', "'", "[", "{", "(", "\\", "#", "\0", "\r", ",", "-", ".", "\u2028", "<")
        )
        text = text[:at] + long * rng.choice((1, 1, 3, 3000, _DEEP)) + text[at:]
    else:
        return _encoded(text, rng)
    return text.encode("utf-8", "surrogateescape")


def _repeated(text: str, times: int) -> str:
    """Return a text so many times, or as often as makes a file that is still quick to write."""
    return text * min(times, max(2, MOST_BYTES // (len(text) + 1)))


def _lines_changed(text: str, rng: Random) -> str:
    lines = text.splitlines(keepends=True) or [""]
    at = rng.randrange(len(lines))
    kind = rng.randrange(6)
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines[at] = _repeated(lines[at], rng.choice((2, 10, _MANY)))
    elif kind == 2:
        other = rng.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]
    elif kind == 3:
        lines[at] = _repeated(lines[at].rstrip("\n"), rng.choice((2, 1000))) + "\n"
    elif kind == 4:
        rng.shuffle(lines)
    else:
        lines[at] = lines[at][: rng.randrange(len(lines[at]) + 1)]
    return "".join(lines)


def _encoded(text: str, rng: Random) -> bytes:
    return rng.choice(
        (
            text.encode("utf-16", "replace"),
            b"\xef\xbb\xbf" + text.encode("utf-8", "replace"),
            text.encode("latin-1", "replace") + b"\xe9\xff",
            text.replace("\n", "\r\n").encode("utf-8", "replace"),
            text.replace("\n", "\r").encode("utf-8", "replace"),
        )
    )


def replaced(text: str, pattern: str, by: str, rng: Random) -> str:
    """Replace one occurrence of a pattern; in a long text one near a random place."""
    start = rng.randrange(max(1, len(text) - 2000))
    found = list(re.compile(pattern).finditer(text, start, start + 4000))
    if not found:
        return text + by
    one = rng.choice(found)
    return text[: one.start()] + by + text[one.end() :]
