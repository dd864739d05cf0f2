"""Instructions: grammatical, many, the same for a seed, and silent about what nobody knows."""

from __future__ import annotations

import re

import numpy as np
import pytest

from manitwin.episodes.instructions import episode_instructions
from manitwin.episodes.naming import is_distinguishable, names_of
from manitwin.errors import UsageError
from manitwin.models.annotators.descriptions import write_captions
from manitwin.models.annotators.priors import load_priors
from manitwin.twin.record import Language

START = np.array([0.5, 0.0, 0.0])


def words(**changes: str) -> Language:
    told = {
        "category": "mug", "color": "dark red (60 %), white (40 %)", "material": "ceramic", "size": "12 x 9 x 8 cm, hand-sized",
        "shape": "cylindrical with a side handle", "function": "holding hot drinks", "caption": "A dark red mug.",
    }  # fmt: skip
    return Language(**{**told, **changes}, captions=["a shiny dark red mug", "Pick up the mug."])


def said(language: Language, way: tuple[float, float] = (0.0, 0.2), **more: object) -> tuple[str, ...]:
    return episode_instructions(language, START, START + np.array([*way, 0.0]), **{"seed": 0, **more})  # type: ignore[arg-type]


def names(language: Language, *others: Language) -> list[str]:
    return [name.words for name in names_of(language, others)]


def test_an_object_has_many_names() -> None:
    assert names(words()) == [
        "mug", "dark red and white mug", "ceramic mug", "dark red and white ceramic mug", "hand-sized mug",
        "hand-sized dark red and white mug", "mug for holding hot drinks", "mug with a side handle", "dark red mug",
    ]  # fmt: skip


def test_instructions_differ_and_use_every_template_before_any_again() -> None:
    for seed in range(20):
        spoken = said(words(), (0.2, 0.2), seed=seed, count=10)
        assert len(set(spoken)) == 10
        openings = {re.sub(r"\b(?:the|a)\b.*", "", text) for text in spoken}
        assert len(openings) >= 9  # of ten templates two begin with "the"


def test_the_same_seed_gives_the_same_words_and_another_gives_others() -> None:
    assert said(words(), seed=3) == said(words(), seed=3)
    assert len({said(words(), seed=seed) for seed in range(30)}) == 30


@pytest.mark.parametrize(
    ("way", "expected"),
    [
        ((0.0, 0.2), "further to the left"),
        ((0.0, -0.2), "further to the right"),
        ((0.2, 0.0), "farther away from the robot"),
        ((-0.2, 0.01), "closer to the robot"),
        ((-0.2, -0.2), "further to the right and closer to the robot"),
        ((0.2, 0.2), "further to the left and farther away from the robot"),
        ((0.0, 0.0), "in the same place"),
    ],
)
def test_the_way_is_told_as_the_robot_sees_it(way: tuple[float, float], expected: str) -> None:
    told = [text for text in said(words(), way, count=8) if " cm " not in text]
    assert told and all(expected in text for text in told)


def test_distances_are_rounded_and_only_told_along_an_axis() -> None:
    straight = {t for seed in range(20) for t in said(words(), (0.01, -0.23), seed=seed) if " cm " in t}
    assert straight and all("about 25 cm to the right" in text for text in straight)
    assert not [t for seed in range(20) for t in said(words(), (0.2, 0.2), seed=seed) if " cm " in t]


def test_plural_things_are_spoken_of_as_such() -> None:
    scissors = words(category="scissors", caption="A pair of scissors.", shape="two blades", function="cutting paper")
    spoken = [text for seed in range(20) for text in said(scissors, seed=seed)]
    assert any(
        "there is a pair of dark red and white scissors" in t or "there is a pair of scissors" in t for t in spoken
    )
    assert not [text for text in spoken if re.search(r"\bit\b|a pair of pair|\ba scissors", text)]
    assert any("put them down" in text for text in spoken)
    keys = [text for seed in range(20) for text in said(words(category="chips"), seed=seed)]
    assert any("there are some" in text for text in keys) and not [t for t in keys if re.search(r"\bit\b", t)]
    for one in ("glass", "camera lens", "thermos", "bag of chips", "octopus"):
        assert all("them" not in text for text in said(words(category=one), count=9)), one


def test_articles_follow_the_sound() -> None:
    orange = [t for seed in range(60) for t in said(words(category="egg cup", color="orange"), seed=seed)]
    there = [text for text in orange if text.startswith("there is")]
    assert there and all(re.match(r"there is (?:an (?:egg|orange)|a (?:ceramic|hand|shiny|dark))", t) for t in there)


def test_what_is_unknown_is_not_said() -> None:
    nothing = words(
        category="unknown", color="unknown color (untextured)", material="unknown material", shape="irregular",
        function="unknown function (no name given that the priors know)", size="unknown", caption="An unknown object.",
    )  # fmt: skip
    nothing = nothing.model_copy(update={"captions": ["an object of unknown use"]})
    assert names(nothing) == ["object"]
    spoken = [text for seed in range(30) for text in said(nothing, seed=seed, count=8)]
    assert not [text for text in spoken if "unknown" in text.lower()]
    assert len(said(nothing, count=8)) == 8


def test_every_category_of_the_priors_gives_clean_instructions() -> None:
    clean = re.compile(r"[a-z0-9][a-z0-9 ,:;&+-]*[a-z]")
    for number, prior in enumerate(load_priors().values()):
        captions = write_captions(
            prior.category, prior, prior.material, "red and white", prior.shape, "9 x 9 x 9 cm, palm-sized"
        )
        language = Language(
            category=prior.category, color="red (60 %), white (40 %)", material=prior.material, shape=prior.shape,
            size="9 x 9 x 9 cm, palm-sized", function=prior.function, caption=captions[0], captions=captions,
        )  # fmt: skip
        for text in said(language, seed=number, count=8):
            assert clean.fullmatch(text), text
            assert "unknown" not in text and "  " not in text and "(" not in text, text
            assert not re.search(r"\b(\w{4,}) \1\b", text), text


def test_a_name_that_fits_another_object_too_is_left_out() -> None:
    red, blue = words(), words(color="blue", caption="A blue mug.", size="20 x 9 x 8 cm, large")
    blue = blue.model_copy(update={"captions": []})
    told = names(red, blue)
    assert told == [
        "dark red and white mug", "dark red and white ceramic mug", "hand-sized mug", "hand-sized dark red and white mug",
        "dark red mug",
    ]  # fmt: skip
    assert names(red, words(category="bowl")) == names(red)
    twin = names(red, red)
    assert twin and all(len(name.split()) > 1 for name in twin)  # nothing tells them apart: the most particular names


@pytest.mark.parametrize("count", [0, 10_000])
def test_a_count_that_cannot_be_met_is_an_error(count: int) -> None:
    with pytest.raises(UsageError, match="give 1 to"):
        said(words(), count=count)


@pytest.mark.parametrize(
    ("category", "other"),
    [
        ("cup", "measuring cup"),
        ("cup", "mug"),
        ("bowl", "sugar bowl"),
        ("jar", "jar of honey"),
        ("spoon", "cooking spoon"),
    ],
)
def test_a_name_that_another_kind_goes_by_too_is_not_said(category: str, other: str) -> None:
    thing = words(category=category, color="red", caption=f"A red {category}.")
    blue = words(category=other, color="blue", caption=f"A blue {other}.")
    told = names(thing, blue)
    assert told and all("red" in name for name in told)
    assert names(blue, thing)[0] == other  # the longer name means one alone
    assert not is_distinguishable(thing, [words(category=other, color="red", caption=f"A red {other}.")])


def test_what_only_ends_alike_is_another_thing() -> None:
    assert names(words(category="glass"), words(category="magnifying glass"))[0] == "glass"
    assert names(words(category="cookie box"), words(category="cracker box"))[0] == "cookie box"
