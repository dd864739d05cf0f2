"""JSON schema of an answer, restricted to what the structured output of all servers supports.

OpenAI requires every property and allows no additional ones, requires an object at the root, and supports neither ``allOf``
nor tuples. Anthropic supports no limits of numbers, strings and lists, and no recursion. Both support ``enum`` and ``anyOf``
(https://platform.openai.com/docs/guides/structured-outputs,
https://platform.claude.com/docs/en/build-with-claude/structured-outputs). Limits are therefore stated in descriptions and
enforced by validation afterwards.
"""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

# descriptions of the keywords of JSON Schema 2020-12, validation vocabulary
_LIMITS = {
    "minimum": "at least {}",
    "exclusiveMinimum": "more than {}",
    "maximum": "at most {}",
    "exclusiveMaximum": "less than {}",
    "multipleOf": "a multiple of {}",
    "minLength": "at least {} characters",
    "maxLength": "at most {} characters",
    "pattern": "matching {}",
    "format": "as {}",
    "minItems": "at least {} items",
    "maxItems": "at most {} items",
}
_KEPT = ("description", "type", "enum")
_DROPPED = ("title", "default", "$defs", "examples", "discriminator")


def strict_schema(answer: type[BaseModel]) -> dict[str, Any]:
    """Return the schema of an answer with all properties required, references inlined, and limits stated in descriptions.

    Raises TypeError for unsupported types: recursion, tuples, dictionaries with arbitrary keys.
    """
    whole = answer.model_json_schema()
    return _strict(whole, whole.get("$defs", {}), ())


def _strict(schema: dict[str, Any], definitions: dict[str, Any], above: tuple[str, ...]) -> dict[str, Any]:
    """Convert a schema recursively; ``above`` are the names of enclosing definitions, to detect recursion."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        if name in above:
            raise TypeError(f"{name} contains itself; structured output takes no recursion")
        found = _strict(definitions[name], definitions, (*above, name))
        return {**found, **{key: schema[key] for key in ("description",) if key in schema}}
    strict: dict[str, Any] = {key: schema[key] for key in _KEPT if key in schema}
    for key, value in schema.items():
        if key == "const":
            strict["enum"] = [value]
        elif key in ("anyOf", "oneOf"):
            strict["anyOf"] = [_strict(choice, definitions, above) for choice in value]
        elif key == "items":
            strict["items"] = _strict(value, definitions, above)
        elif key == "properties":
            strict["properties"] = {name: _strict(part, definitions, above) for name, part in value.items()}
        elif key == "additionalProperties" and value is not False:
            raise TypeError("a dictionary of free keys cannot be asked for; ask for a list of objects")
        elif key not in (*_KEPT, *_LIMITS, *_DROPPED, "required", "additionalProperties"):
            raise TypeError(f"{key!r} cannot be asked for by structured output")
    if schema.get("type") == "object":
        strict["properties"] = strict.get("properties", {})
        strict |= {"required": list(strict["properties"]), "additionalProperties": False}
    limits = [words.format(schema[key]) for key, words in _LIMITS.items() if key in schema]
    if limits:
        said = strict.get("description", "").rstrip(". ")
        strict["description"] = f"{said} ({', '.join(limits)})" if said else ", ".join(limits)
    return strict
