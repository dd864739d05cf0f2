"""Names of parts: the same in other words, a place on a listed part, and what is neither."""

from __future__ import annotations

import pytest

from manitwin.dataset.evaluation.part_names import is_on_any, is_same_part, matches_any


def test_names_are_the_same_where_the_words_of_one_are_among_those_of_the_other() -> None:
    assert (
        is_same_part("pull tab", "tab")
        and is_same_part("blade", "cutting blades")
        and is_same_part("Handle", "handles")
    )
    assert not is_same_part("handle", "head") and not is_same_part("", "handle")


@pytest.mark.parametrize(
    ("name", "listed"),
    [
        ("front", "body"),
        ("back face", "foam body"),
        ("underside", "body of the jug"),
        ("back", "narrow sides"),
        ("lip of the jug", "rim"),
        ("mouth", "opening"),
        ("head", "tines"),
        ("grip", "handles"),
        ("toe", "upper"),
        ("housing", "body"),
        ("cooking surface", "inner floor"),
    ],
)
def test_what_is_on_a_listed_part_or_is_it_in_another_word_is_right(name: str, listed: str) -> None:
    assert is_on_any(name, ["hinge", listed])
    assert not matches_any(name, ["hinge", listed]), "the name itself is another"


@pytest.mark.parametrize(
    ("name", "listed"),
    [
        ("handle", "body"),
        ("top", "body"),
        ("upper part", "body"),
        ("cutting head", "cutting wheel"),
        ("cutting head", "blade"),
        ("body", "base"),
        ("body", "front"),
        ("cap", "neck"),
        ("base", "handle of the body"),
        ("", "body"),
    ],
)
def test_what_is_another_part_or_the_whole_of_a_listed_one_is_wrong(name: str, listed: str) -> None:
    assert not is_on_any(name, ["hinge", listed])
