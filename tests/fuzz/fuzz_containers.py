"""Mutations of files that hold other content: PLY behind its header, GLB, PNG."""

from __future__ import annotations

import struct
import zlib
from random import Random

from fuzz_documents import mutate_json
from fuzz_numbers import INTEGERS
from fuzz_plain import mutate_bytes, mutate_text, replaced

_DEEP, _MANY = 100_000, 20_000


def mutate_ply(content: bytes, rng: Random) -> bytes:
    """Change the header of a PLY, or of an ASCII one anything."""
    end = content.find(b"end_header")
    head, body = (content, b"") if end < 0 else (content[:end], content[end:])
    if b"format ascii" in head and rng.random() < 0.5:
        return mutate_text(content, rng)
    if rng.random() < 0.3:
        types = (
            "char",
            "uchar",
            "short",
            "ushort",
            "int",
            "uint",
            "float",
            "double",
            "int64",
            "list uchar int",
            "list int double",
        )
        return (
            replaced(
                head.decode("latin-1"), r"(list \w+ \w+|float\d*|double|u?int\d*|uchar)", rng.choice(types), rng
            ).encode("latin-1")
            + body
        )
    return mutate_text(head, rng) + body


def mutate_glb(content: bytes, rng: Random) -> bytes:
    """Change the JSON chunk of a GLB, its binary chunk, or a length in its header."""
    if content[:4] != b"glTF" or len(content) < 20:
        return mutate_bytes(content, rng)
    size = int.from_bytes(content[12:16], "little")
    document, rest = content[20 : 20 + size], content[20 + size :]
    if rng.random() < 0.75:
        document = mutate_json(document.rstrip(b" \0"), rng)
        document += b" " * (-len(document) % 4)
    else:
        rest = mutate_bytes(rest, rng)
    length, chunk = 20 + len(document) + len(rest), len(document)
    if rng.random() < 0.1:
        length, chunk = rng.choice(((rng.choice(INTEGERS), chunk), (length, rng.choice(INTEGERS))))
    return b"glTF" + struct.pack("<III", 2, length & 0xFFFFFFFF, chunk & 0xFFFFFFFF) + b"JSON" + document + rest


def mutate_png(content: bytes, rng: Random) -> bytes:
    """Change a chunk of a PNG and give it the right check sum, so that what reads the chunk is reached."""
    chunks, at = [], 8
    while at + 12 <= len(content):
        size = int.from_bytes(content[at : at + 4], "big")
        chunks.append((content[at + 4 : at + 8], content[at + 8 : at + 8 + size]))
        at += 12 + size
    if not chunks or rng.random() < 0.2:
        return mutate_bytes(content, rng)
    at = rng.randrange(len(chunks))
    kind, data = chunks[at]
    change = rng.randrange(6)
    if change <= 2:
        chunks[at] = (kind, mutate_bytes(data, rng))
    elif change == 3:
        chunks[at:at] = [(kind, data)] * rng.choice((1, 1, 1000))
    elif change == 4:
        del chunks[at]
    else:
        name = rng.choice(
            (b"iCCP", b"tEXt", b"zTXt", b"iTXt", b"eXIf", b"gAMA", b"cHRM", b"tRNS", b"PLTE", b"acTL", b"sRGB", b"fcTL")
        )
        body = rng.choice(
            (b"", b"x", b"x\0\0" + zlib.compress(b"\0" * 30_000_000), b"icc\0\0" + zlib.compress(b"\0" * 300), b"MM\0*")
        )
        chunks[1:1] = [(name, body)]
    told = (
        len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big") for kind, data in chunks
    )
    return content[:8] + b"".join(told)
