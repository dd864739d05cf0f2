"""Which words mean one object of a picture, and what somebody may take one thing for."""

from __future__ import annotations

import random
from types import SimpleNamespace
from typing import Any

import pytest

from manitwin.scenes.vqa.functional_planning import _content
from manitwin.scenes.vqa.nouns import noun_of
from manitwin.scenes.vqa.references import a_or_an, could_be_asked_for, find_references, is_container, one_of


def picture(*things: tuple[str, str | None]) -> Any:
    """A picture with things of a category and a colour, from left to right."""
    seen = [
        SimpleNamespace(
            thing=SimpleNamespace(name=f"object_{i:02d}", category=category, head=noun_of(category)),
            color=color, is_clear=True, is_hidden=False, column=100.0 * i,
        )
        for i, (category, color) in enumerate(things)
    ]  # fmt: skip
    return SimpleNamespace(seen=seen, clear_objects=seen, camera=SimpleNamespace(width_px=512))


def words(*things: tuple[str, str | None]) -> list[str | None]:
    found = find_references(picture(*things), random.Random(0))
    return [found.get(f"object_{i:02d}") for i in range(len(things))]


def test_a_magnifying_glass_is_no_glass_that_is_leftmost() -> None:
    assert words(("magnifying glass", None), ("wine glass", None)) == ["the magnifying glass", "the wine glass"]
    assert words(("trash can", None), ("drink can", None)) == ["the trash can", "the drink can"]
    two = words(("magnifying glass", None), ("magnifying glass", None))
    assert two == [
        "the magnifying glass that is leftmost in the picture",
        "the magnifying glass that is rightmost in the picture",
    ]


def test_things_of_one_noun_are_told_apart_by_place_or_color() -> None:
    outermost = ["the bottle that is leftmost in the picture", "the bottle that is rightmost in the picture"]
    assert words(("water bottle", None), ("shampoo bottle", None)) == outermost
    assert words(("mug", "red"), ("mug", "blue")) == ["the red mug", "the blue mug"]


@pytest.mark.parametrize("other", ["mug", "cup and saucer"])
def test_a_cup_has_no_words_where_something_else_may_be_called_one(other: str) -> None:
    assert words(("cup", None), (other, None))[0] is None
    assert words(("cup", "green"), (other, "red"))[0] == "the green cup"


def test_a_key_beside_an_allen_key_is_not_surely_the_key() -> None:
    assert words(("key", None), ("allen key", None)) == [None, "the allen key"]
    assert words(("key", "gold"), ("allen key", "black")) == ["the gold key", "the allen key"]


def test_what_something_there_may_be_taken_for_is_not_said_to_be_absent() -> None:
    assert could_be_asked_for("cup", {"cup and saucer", "gear"})
    assert could_be_asked_for("saucer", {"cup and saucer"})
    assert could_be_asked_for("cup", {"mug"}) and could_be_asked_for("mug", {"cup"})
    assert could_be_asked_for("box", {"bowl"})
    assert could_be_asked_for("key", {"allen key"}) and could_be_asked_for("allen key", {"key"})
    assert not could_be_asked_for("wine glass", {"thermos", "mug"})


def test_containers() -> None:
    assert [is_container(each) for each in ("mug", "water bottle", "soup can")] == [True] * 3
    assert [is_container(each) for each in ("cup and saucer", "trash can", "wine glass", "vase")] == [None] * 4
    assert [is_container(each) for each in ("hammer", "scissors", "gear")] == [False] * 3


def test_what_a_thing_holds_or_is_made_of_is_not_its_noun() -> None:
    assert [noun_of(each) for each in ("jar of honey", "bottle of wine", "bag with handles", "pair of pliers")] == [
        "jar", "bottle", "bag", "pliers",
    ]  # fmt: skip
    assert is_container("jar of honey") and is_container("can of tuna")
    assert is_container("box of cereal") is None  # as a cereal box
    for asked in ("jar", "honey", "honey jar", "jam jar"):
        assert could_be_asked_for(asked, {"jar of honey"}), asked
    assert could_be_asked_for("jar of honey", {"jam jar"}) and could_be_asked_for("soap", {"bar of soap"})
    assert not could_be_asked_for("mug", {"jar of honey"})
    assert one_of("pair of pliers", "red") == "red pair of pliers"


def test_who_serves_tea_in_a_cup_holds_hot_drinks_in_a_mug() -> None:
    assert _content("holding hot drinks") & _content("serving tea or coffee")
    assert _content("drinking wine") & _content("carrying drinking water")
    assert not _content("holding hot drinks") & _content("driving nails")


def test_articles_follow_the_sound() -> None:
    assert [a_or_an(each) for each in ("hourglass", "usb stick", "apple", "mug")] == [
        "an hourglass", "a usb stick", "an apple", "a mug",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("noun", "words"),
    [
        ("soap", "a bar of soap"),
        ("soap bar", "a soap bar"),
        ("bread", "a loaf of bread"),
        ("scissors", "a pair of scissors"),
        ("safety goggles", "a pair of safety goggles"),
        ("hourglass", "an hourglass"),
        ("mug", "a mug"),
    ],
)
def test_one_of_what_is_not_counted_by_itself_is_so_much_of_it(noun: str, words: str) -> None:
    assert a_or_an(one_of(noun)) == words
