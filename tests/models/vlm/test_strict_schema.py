"""Schemas that both vendors take, checked by the independent rules of the fakes."""

from __future__ import annotations

from typing import Literal

import pytest
from pydantic import BaseModel, Field

from manitwin.models.fakes.chat import anthropic_complaint, openai_complaint
from manitwin.models.vlm.strict_schema import strict_schema


class Point(BaseModel):
    """One point."""

    rationale: str = Field(description="Why.", max_length=200)
    id: Literal[3, 7]


class Whole(BaseModel):
    name: str
    share: float = Field(ge=0, le=1, description="Share of the volume.")
    kind: Literal["only"]
    axis: str | None = None
    best: Point = Field(description="The best one.")
    points: list[Point] = Field(min_length=2, max_length=3)


class Tree(BaseModel):
    children: list[Tree]


class Free(BaseModel):
    anything: dict[str, float]


class Pair(BaseModel):
    both: tuple[int, str]


def test_schema_is_within_the_subset_of_both_vendors() -> None:
    schema = strict_schema(Whole)
    assert openai_complaint(schema) is None
    assert anthropic_complaint(schema) is None


def test_pydantic_schema_itself_is_not() -> None:
    assert openai_complaint(Whole.model_json_schema()) is not None
    assert anthropic_complaint(Whole.model_json_schema()) is not None


def test_properties_keep_their_order_and_are_all_required() -> None:
    schema = strict_schema(Whole)
    assert list(schema["properties"]) == ["name", "share", "kind", "axis", "best", "points"]
    assert schema["required"] == list(schema["properties"])
    assert list(schema["properties"]["points"]["items"]["properties"]) == ["rationale", "id"]


def test_limits_are_said_in_words() -> None:
    properties = strict_schema(Whole)["properties"]
    assert properties["share"] == {"type": "number", "description": "Share of the volume (at least 0, at most 1)"}
    assert properties["points"]["description"] == "at least 2 items, at most 3 items"
    assert properties["kind"]["enum"] == ["only"]
    assert properties["best"]["description"] == "The best one."
    assert properties["best"]["properties"]["id"]["enum"] == [3, 7]
    assert [choice["type"] for choice in properties["axis"]["anyOf"]] == ["string", "null"]


@pytest.mark.parametrize("answer", [Tree, Free, Pair])
def test_what_cannot_be_asked_for_is_said(answer: type[BaseModel]) -> None:
    with pytest.raises(TypeError):
        strict_schema(answer)
