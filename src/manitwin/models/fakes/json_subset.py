"""Which JSON schemas the structured output of each vendor takes, and what it says of others.

OpenAI: https://platform.openai.com/docs/guides/structured-outputs ("Supported schemas"; that text limits are refused, and the
words of the errors except that of ``additionalProperties``, are unverified). Anthropic:
https://platform.claude.com/docs/en/build-with-claude/structured-outputs ("JSON Schema limitations"), words as in
https://github.com/agentjido/req_llm/issues/302 and https://github.com/ghostlobster/memorize-everything/issues/93.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

_SHARED = {
    "type",
    "description",
    "title",
    "enum",
    "const",
    "anyOf",
    "properties",
    "required",
    "items",
    "$ref",
    "$defs",
} | {
    "additionalProperties",
    "default",
    "format",
}
_OPENAI = _SHARED | {
    "pattern",
    "multipleOf",
    "minimum",
    "maximum",
    "exclusiveMinimum",
    "exclusiveMaximum",
    "minItems",
    "maxItems",
}
_ANTHROPIC = _SHARED | {"allOf", "minItems", "pattern"}
MAX_PROPERTIES = 5000
MAX_ENUM_VALUES = 1000
MAX_DEPTH = 10


def openai_complaint(schema: dict[str, Any]) -> str | None:
    """Return what OpenAI's strict mode says against a schema, None where it takes it."""
    if schema.get("type") != "object":
        return f"schema must be a JSON Schema of 'type: \"object\"', got 'type: \"{schema.get('type')}\"'."
    properties = values = 0
    for path, part, depth in _parts(schema, (), 1):
        where = f"In context={path!r}, "
        unknown = sorted(set(part) - _OPENAI)
        if unknown:
            return f"{where}'{unknown[0]}' is not permitted."
        if part.get("type") == "object":
            if part.get("additionalProperties") is not False:
                return f"{where}'additionalProperties' is required to be supplied and to be false."
            missing = sorted(set(part.get("properties", {})) - set(part.get("required", [])))
            if missing:
                return (
                    f"{where}'required' is required to be supplied and to be an array including every key in properties."
                    f" Missing '{missing[0]}'."
                )
        elif not {"type", "anyOf", "$ref", "enum", "const"} & set(part):
            return f"{where}schema must have a 'type' key."
        properties, values = properties + len(part.get("properties", {})), values + len(part.get("enum", []))
        if depth > MAX_DEPTH or properties > MAX_PROPERTIES or values > MAX_ENUM_VALUES:
            return f"{where}schema exceeds the limits of depth, properties or enum values."
    return None


def anthropic_complaint(schema: dict[str, Any]) -> str | None:
    """Return what Anthropic says against a schema, None where it takes it."""
    for _, part, _ in _parts(schema, (), 1):
        kind = part.get("type", "schema")
        if kind == "object" and part.get("additionalProperties") is not False:
            return "For 'object' type, 'additionalProperties' must be explicitly set to false"
        unknown = sorted(set(part) - _ANTHROPIC)
        if unknown:
            return f"For '{kind}' type, property '{unknown[0]}' is not supported"
        if part.get("minItems", 0) not in (0, 1):
            return "For 'array' type, 'minItems' values other than 0 or 1 are not supported"
        if any(isinstance(value, dict | list) for value in part.get("enum", [])):
            return "Enum values must be primitive"
    return None


def _parts(
    schema: dict[str, Any], path: tuple[str, ...], depth: int
) -> Iterator[tuple[tuple[str, ...], dict[str, Any], int]]:
    yield path, schema, depth
    for name, part in schema.get("properties", {}).items():
        yield from _parts(part, (*path, "properties", name), depth + 1)
    for name, part in schema.get("$defs", {}).items():
        yield from _parts(part, (*path, "$defs", name), depth)
    if isinstance(schema.get("items"), dict):
        yield from _parts(schema["items"], (*path, "items"), depth + 1)
    for word in ("anyOf", "allOf"):
        for index, part in enumerate(schema.get(word, [])):
            yield from _parts(part, (*path, word, str(index)), depth)
