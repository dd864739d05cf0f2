"""A name and a size that a person says of an input: what they take the place of, and what takes them back."""

from __future__ import annotations

import pytest

from manitwin.config import GateConfig
from manitwin.dataset.review.object_statements import (
    ObjectStatement,
    current_statement,
    name_remark,
    read_side_cm,
    with_statement,
)
from manitwin.errors import UsageError
from manitwin.pipeline.human_corrections import CATEGORY, NAME, NAME_STAGES, SIZE, STAGES
from manitwin.pipeline.item import Item

NAMELESS = Item("/photos/a.jpg")


def measure(value_m: float) -> dict[str, object]:
    return {"value": value_m, "low": value_m, "high": value_m, "source": "human:ben"}


def test_what_was_corrected_before_is_replaced_and_the_rest_stays() -> None:
    before = {stage: {CATEGORY: "cup"} for stage in STAGES[CATEGORY]}
    before["physical"] |= {SIZE: measure(0.2), "mass_kg": measure(0.3)}
    assert current_statement(NAMELESS, before) == ObjectStatement("cup", "20")
    after = with_statement(before, NAMELESS, ObjectStatement("mug", "12.5"), "human:ada")
    assert current_statement(NAMELESS, after) == ObjectStatement("mug", "12.5")
    assert after["physical"] == {NAME: {"value": "mug", "source": "human:ada"}, "mass_kg": measure(0.3)}
    assert after["mesh"][SIZE]["value"] == 0.125 and set(after) == set(NAME_STAGES)
    assert with_statement(after, NAMELESS, ObjectStatement(), "human:ada") == {"physical": {"mass_kg": measure(0.3)}}
    assert before["caption"] == {CATEGORY: "cup"}, "what was given is not changed"


def test_words_that_an_input_was_given_with_are_no_amendment() -> None:
    item = Item("/photos/a.jpg", name="mug", longest_side_m=1 / 3)
    assert current_statement(item, {}) == ObjectStatement("mug", "33.3333")
    assert with_statement({}, item, current_statement(item, {}), "human:ada") == {}
    said = with_statement({}, item, ObjectStatement("cup", "12"), "human:ada")
    assert (
        current_statement(item, said) == ObjectStatement("cup", "12")
        and with_statement(said, item, ObjectStatement(), "human:ben") == {}
    )


def test_length_where_a_unit_was_stated_is_refused_as_in_a_manifest() -> None:
    item = Item("/photos/a.jpg", name="mug", units="cm", views=("/photos/b.jpg",), poses="/photos/transforms.json")
    with pytest.raises(UsageError, match="the unit cm already determines the size"):
        with_statement({}, item, ObjectStatement("mug", "12"), "human:ada")
    assert current_statement(item, with_statement({}, item, ObjectStatement("cup", ""), "human:ada")).name == "cup"


def test_lengths_are_those_that_the_data_set_takes_things_of() -> None:
    gate = GateConfig(min_longest_side_m=0.01, max_longest_side_m=0.5)
    assert [read_side_cm(typed, gate) for typed in ("", " 1 ", "50", "12,25")] == ["", "1", "50", "12.25"]
    for typed in ("0.99", "50.1", "-5", "NaN", "Infinity", "12 cm"):
        with pytest.raises(UsageError, match="give centimetres from 1 to 50"):
            read_side_cm(typed, gate)


def test_remark_says_how_long_such_things_are_or_names_the_nearest() -> None:
    assert name_remark("coffee mugs").startswith("known as: mug, ")
    assert "did you mean 'bottle'" in name_remark("botle") and name_remark("") == ""
