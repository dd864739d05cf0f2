"""Mutations of the structure of JSON and XML."""

from __future__ import annotations

import json
import re
from random import Random
from typing import Any

from fuzz_numbers import NUMBERS, TEXTS
from fuzz_plain import mutate_text, replaced

_DEEP, _MANY = 100_000, 20_000
_RAW = "@@raw-%d@@"


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
        return rng.choice(
            (-old, old + 1, old * 1000, 0, -1, old / 3 if abs(old) < 1e300 else 3, 1e12, 2**31, 2**32, 2**63, 2**64)
        )
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
        text = replaced(text, r"(?<==\")[^\"]*(?=\")", _attribute(rng.choice((*NUMBERS, *TEXTS))), rng)
    elif kind == 3:
        text = replaced(text, r"\s[\w:]+=\"[^\"]*\"", "", rng)
    elif kind == 4:
        text = replaced(text, r"</?[\w:]+", "<" + rng.choice(re.findall(r"<([\w:]+)", text) or ["x"]), rng)
    elif kind <= 6:
        text = _element_changed(text, rng)
    elif kind == 7:
        text = replaced(text, r"(?<=>)[^<]+(?=<)", _attribute(rng.choice((*NUMBERS, *TEXTS))), rng)
    elif kind == 8:
        entities = (
            '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;">]>',
            '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/hostname">]>', '<!DOCTYPE x SYSTEM "file:///etc/hostname">',
            '<?xml version="1.0" encoding="utf-7"?>', '<?xml version="1.0" encoding="nonsense"?>', '<?xml version="9"?>',
        )  # fmt: skip
        text = rng.choice(entities) + re.sub(r"<\?xml[^>]*>", "", text)
        text = replaced(text, r"(?<==\")[^\"]*(?=\")", "&c;&a;", rng)
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
