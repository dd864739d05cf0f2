"""Mutations of files: of the structure that a format has (JSON, XML, lines of text, archives, GLB), and of plain bytes.

``mutated(name, content, others, rng)`` chooses by the file's name. The same generator gives the same bytes.
"""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Sequence
from random import Random
from typing import Any

from fuzz_numbers import INTEGERS, NUMBERS, TEXTS

Mutation = Callable[[bytes, Random], bytes]

_DEEP, _MANY = 100_000, 20_000
_MOST_BYTES = 16 << 20
_RAW = "@@raw-%d@@"


def mutated(name: str, content: bytes, others: Sequence[bytes], rng: Random) -> bytes:
    """Return the content of a file with one to four mutations; ``others`` are contents to splice with."""
    structured = _structured(name, content)
    for _ in range(1 + min(3, int(rng.expovariate(1.2)))):
        if structured is not None and rng.random() < 0.7:
            content = structured(content, rng)
        elif others and rng.random() < 0.1:
            content = _spliced(content, rng.choice(others), rng)
        else:
            content = mutate_bytes(content, rng)
        if len(content) > _MOST_BYTES:
            break
    return content


def _structured(name: str, content: bytes) -> Mutation | None:
    suffix = name.rpartition(".")[2].lower()
    if suffix == "ply":
        return mutate_ply
    if suffix == "stl":
        return mutate_text if content[:5] == b"solid" else None
    return _BY_SUFFIX.get(suffix)


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


def _spliced(content: bytes, other: bytes, rng: Random) -> bytes:
    return content[: rng.randrange(len(content) + 1)] + other[rng.randrange(len(other) + 1) :]


def mutate_text(content: bytes, rng: Random) -> bytes:
    """Change numbers, words, lines, quotes or the encoding of a text."""
    text = content.decode("utf-8", "surrogateescape")
    kind = rng.randrange(12)
    if kind <= 3:
        text = _replaced(text, r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?", rng.choice(NUMBERS), rng)
    elif kind <= 5:
        text = _replaced(text, r"[^\s\"'<>=,;(){}\[\]]+", rng.choice((*TEXTS, *NUMBERS)), rng)
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
    return text * min(times, max(2, _MOST_BYTES // (len(text) + 1)))


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


def _replaced(text: str, pattern: str, by: str, rng: Random) -> str:
    """Replace one occurrence of a pattern; in a long text one near a random place."""
    start = rng.randrange(max(1, len(text) - 2000))
    found = list(re.compile(pattern).finditer(text, start, start + 4000))
    if not found:
        return text + by
    one = rng.choice(found)
    return text[: one.start()] + by + text[one.end() :]


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
            _replaced(
                head.decode("latin-1"), r"(list \w+ \w+|float\d*|double|u?int\d*|uchar)", rng.choice(types), rng
            ).encode("latin-1")
            + body
        )
    return mutate_text(head, rng) + body


def mutate_json(content: bytes, rng: Random) -> bytes:
    """Change a value, key, type, length or depth of a JSON document; a text that is none is changed as a text."""
    try:
        document = json.loads(content)
    except (ValueError, RecursionError):
        return mutate_text(content, rng)
    return _json_changed(document, rng).encode("utf-8", "surrogatepass")


def _json_changed(document: Any, rng: Random) -> str:
    places: list[tuple[Any, Any]] = []
    _collect(document, places)
    raw: list[str] = []
    if not places:
        return json.dumps(rng.choice(([], {}, [document], None)))
    holder, key = rng.choice(places)
    kind = rng.randrange(10)
    if kind <= 4:
        holder[key] = _json_value(rng, raw, holder[key])
    elif kind == 5:
        del holder[key]
    elif kind == 6 and isinstance(holder, dict):
        holder[rng.choice(TEXTS)] = holder.pop(key)
    elif kind == 7 and isinstance(holder, list):
        holder[key:key] = [holder[key]] * rng.choice((1, 3, 1000))
    elif kind == 8:
        other, place = rng.choice(places)
        holder[key] = json.loads(json.dumps(other[place])) if _same_document(other, place) else None
    else:
        holder[key] = [holder[key]] if rng.random() < 0.5 else {"x": holder[key]}
    text = json.dumps(document)
    for number, value in enumerate(raw):
        text = text.replace(json.dumps(_RAW % number), value)
    return text


def _same_document(holder: Any, key: Any) -> bool:
    return (isinstance(holder, dict) and key in holder) or (isinstance(holder, list) and key < len(holder))


def _json_value(rng: Random, raw: list[str], old: Any) -> Any:
    """Return a value to stand in place of another; what JSON cannot say is put in as text afterwards."""
    kind = rng.randrange(6)
    if isinstance(old, (int, float)) and not isinstance(old, bool) and rng.random() < 0.4:
        return rng.choice((-old, old + 1, old * 1000, 0, -1, old / 3, 1e12, 2**31, 2**32, 2**63, 2**64))
    if kind == 0:
        return rng.choice((None, True, False, [], {}, "", [None], {"": None}, [[]], 0, -1, 0.5, 1e308))
    if kind == 1:
        return rng.choice(TEXTS)
    if kind == 2:
        return rng.choice(NUMBERS)
    deep = rng.choice((1000, _DEEP))
    raw.append(
        rng.choice(
            (
                "NaN", "Infinity", "-Infinity", "1e999", "-1e400", "9" * 400, "9" * 5000, "[" * deep + "]" * deep,
                '{"a":' * deep + "1" + "}" * deep, '"\\ud800"', '"' + "x" * 1_000_000 + '"', '{"a":1,"a":2}', "[" * deep,
                "01", "1.", "'x'",
            )
        )
    )  # fmt: skip
    return _RAW % (len(raw) - 1)


def _collect(value: Any, places: list[tuple[Any, Any]], depth: int = 0) -> None:
    if depth > 50 or len(places) > 20_000:
        return
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in entries:
        places.append((value, key))
        _collect(child, places, depth + 1)


def mutate_lines_of_json(content: bytes, rng: Random) -> bytes:
    """Change one line of JSON Lines, or the lines."""
    lines = content.split(b"\n")
    at = rng.randrange(len(lines))
    if rng.random() < 0.7:
        lines[at] = mutate_json(lines[at], rng)
        return b"\n".join(lines)
    return mutate_text(content, rng)


def mutate_xml(content: bytes, rng: Random) -> bytes:
    """Change an attribute, element, text or entity of an XML document."""
    text = content.decode("utf-8", "surrogateescape")
    kind = rng.randrange(11)
    if kind <= 2:
        text = _replaced(text, r"(?<==\")[^\"]*(?=\")", _attribute(rng.choice((*NUMBERS, *TEXTS))), rng)
    elif kind == 3:
        text = _replaced(text, r"\s[\w:]+=\"[^\"]*\"", "", rng)
    elif kind == 4:
        text = _replaced(text, r"</?[\w:]+", "<" + rng.choice(re.findall(r"<([\w:]+)", text) or ["x"]), rng)
    elif kind <= 6:
        text = _element_changed(text, rng)
    elif kind == 7:
        text = _replaced(text, r"(?<=>)[^<]+(?=<)", _attribute(rng.choice((*NUMBERS, *TEXTS))), rng)
    elif kind == 8:
        entities = (
            '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;">]>',
            '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/hostname">]>', '<!DOCTYPE x SYSTEM "file:///etc/hostname">',
            '<?xml version="1.0" encoding="utf-7"?>', '<?xml version="1.0" encoding="nonsense"?>', '<?xml version="9"?>',
        )  # fmt: skip
        text = rng.choice(entities) + re.sub(r"<\?xml[^>]*>", "", text)
        text = _replaced(text, r"(?<==\")[^\"]*(?=\")", "&c;&a;", rng)
    else:
        return mutate_text(content, rng)
    return text.encode("utf-8", "surrogateescape")


def _attribute(value: str) -> str:
    return value.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")


def _element_changed(text: str, rng: Random) -> str:
    """Remove, repeat or nest one element with all that is in it."""
    opened = list(re.finditer(r"<([\w:]+)[^<>]*?(/?)>", text))
    if not opened:
        return text
    one = rng.choice(opened)
    close = one.end() if one.group(2) else text.find(f"</{one.group(1)}>", one.end())
    end = one.end() if one.group(2) or close < 0 else close + len(one.group(1)) + 3
    whole = text[one.start() : end]
    nested = rng.choice((300, 3000, _MANY))
    return (
        text[: one.start()]
        + rng.choice(
            (
                "",
                whole * 2,
                whole * (200 if len(whole) > 2000 else 2000),
                f"<{one.group(1)}>" * nested + whole + f"</{one.group(1)}>" * nested,
                f"<{one.group(1)}/>",
                whole[: len(whole) // 2],
            )
        )
        + text[end:]
    )


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


def mutate_archive(content: bytes, rng: Random) -> bytes:
    """Change one file of a ZIP archive, its name, or the number of its files."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            files = [(entry.filename, archive.read(entry)) for entry in archive.infolist()]
    except Exception:  # an archive that an earlier mutation has broken
        return mutate_bytes(content, rng)
    if not files:
        return mutate_bytes(content, rng)
    at = rng.randrange(len(files))
    name, data = files[at]
    kind = rng.randrange(6)
    if kind <= 2:
        files[at] = (name, mutated(name, data, (), rng))
    elif kind == 3:
        files[at] = (
            rng.choice(("../" + name, "/" + name, "", "x" * 300, name.upper(), "a/b/" + name, name + "\0x")),
            data,
        )
    elif kind == 4:
        del files[at]
    else:
        files[at:at] = [(f"{i}{name}", data[:100]) for i in range(rng.choice((1, 500)))]
    buffer = io.BytesIO()
    method = rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, data in files:
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data, method)
    return buffer.getvalue()


_BY_SUFFIX: dict[str, Mutation] = {
    **dict.fromkeys(("json", "gltf"), mutate_json),
    "jsonl": mutate_lines_of_json,
    **dict.fromkeys(("xml", "urdf", "mjcf", "sdf", "dae", "config"), mutate_xml),
    **dict.fromkeys(("toml", "csv", "obj", "mtl", "usda", "pbtxt", "txt", "md", "srdf"), mutate_text),
    **dict.fromkeys(("usdz", "zip", "npz"), mutate_archive),
    "glb": mutate_glb,
    "png": mutate_png,
}
