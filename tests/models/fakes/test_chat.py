"""The subsets of JSON Schema that the vendors document."""

from __future__ import annotations

from typing import Any

import pytest

from manitwin.models.fakes.chat import anthropic_complaint, openai_complaint


def of(part: dict[str, Any], **changes: Any) -> dict[str, Any]:
    schema = {"type": "object", "properties": {"a": part}, "required": ["a"], "additionalProperties": False}
    return schema | changes


@pytest.mark.parametrize(
    "part",
    [
        {"type": "string", "enum": ["x"], "description": "A letter."},
        {"anyOf": [{"type": "number"}, {"type": "null"}]},
        {"type": "array", "items": of({"type": "integer"})},
        {"$ref": "#/$defs/b"},
    ],
)
def test_what_both_take(part: dict[str, Any]) -> None:
    schema = of(part, **{"$defs": {"b": of({"type": "boolean"})}})
    assert openai_complaint(schema) is None
    assert anthropic_complaint(schema) is None


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        ({"type": "array", "items": {"type": "string"}}, "got 'type: \"array\"'"),
        ({"anyOf": [of({"type": "string"})]}, "type"),
        (of({"type": "string"}, required=[]), "Missing 'a'"),
        (
            of({"type": "string"}, additionalProperties=True),
            "'additionalProperties' is required to be supplied and to be false",
        ),
        (of({"type": "array", "items": {"type": "object", "properties": {}}}), "('properties', 'a', 'items')"),
        (of({"allOf": [{"type": "string"}]}), "'allOf' is not permitted"),
        (of({"type": "string", "minLength": 1}), "'minLength' is not permitted"),
        (of({"type": "array", "prefixItems": []}), "'prefixItems' is not permitted"),
        (of({"description": "anything"}), "'type'"),
        (of({"type": "integer", "enum": list(range(1001))}), "limits"),
    ],
)
def test_what_openai_refuses(schema: dict[str, Any], words: str) -> None:
    complaint = openai_complaint(schema)
    assert complaint is not None and words in complaint


@pytest.mark.parametrize(
    ("part", "words"),
    [
        ({"type": "integer", "minimum": 0}, "For 'integer' type, property 'minimum' is not supported"),
        ({"type": "string", "maxLength": 9}, "For 'string' type, property 'maxLength' is not supported"),
        ({"type": "array", "items": {"type": "string"}, "minItems": 2}, "'minItems' values other than 0 or 1"),
        ({"type": "array", "items": {"type": "string"}, "maxItems": 2}, "'maxItems' is not supported"),
        ({"type": "object", "properties": {}}, "'additionalProperties' must be explicitly set to false"),
        ({"enum": [{"a": 1}]}, "primitive"),
    ],
)
def test_what_anthropic_refuses(part: dict[str, Any], words: str) -> None:
    complaint = anthropic_complaint(of(part))
    assert complaint is not None and words in complaint


def test_limits_of_numbers_are_taken_by_openai() -> None:
    assert openai_complaint(of({"type": "number", "minimum": 0, "exclusiveMaximum": 3})) is None
    assert openai_complaint(of({"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 3})) is None
