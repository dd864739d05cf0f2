"""Words: grammatical, true of the measurements, honest about what is not known."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from handmade import cylinder, mug, subject, visual
from manitwin.models.annotators.descriptions import article, is_metal, joined, size_words, write_captions
from manitwin.models.annotators.prior_names import found_by, object_noun
from manitwin.models.annotators.priors import load_priors
from manitwin.models.annotators.rules import RulesAnnotator
from manitwin.twin.record import Language


def described(mesh: trimesh.Trimesh, name: str | None, *parts: trimesh.Trimesh, material: str = "ceramic") -> Language:
    return RulesAnnotator().describe(subject(mesh, name, parts=parts), material, mesh.extents)


@pytest.mark.parametrize(
    ("phrase", "expected"),
    [
        ("mug", "a"), ("apple", "an"), ("orange mug", "an"), ("utensil holder", "a"), ("usb stick", "a"),
        ("umbrella", "an"), ("hourglass", "an"), ("house", "a"), ("ukulele", "a"), ("egg", "an"), ("eraser", "an"),
        ("u joint", "a"), ("s hook", "an"), ("t-shirt", "a"), ("x-ray", "an"), ("L bracket", "an"),
    ],
)  # fmt: skip
def test_article_follows_the_sound(phrase: str, expected: str) -> None:
    assert article(phrase) == expected


@pytest.mark.parametrize(
    ("name", "first", "third"),
    [
        ("kitchen utensils", "Orange kitchen utensils, about", "Large kitchen utensils (boxy)."),
        ("tableware", "Orange tableware, about", "Large tableware (boxy)."),
        ("flux capacitor", "An orange flux capacitor, about", "A large flux capacitor (boxy)."),
        ("brass compass", "An orange brass compass, about", "A large brass compass (boxy)."),
    ],
)
def test_what_is_named_in_the_plural_or_as_no_single_thing_has_no_article(name: str, first: str, third: str) -> None:
    captions = write_captions(name, None, "unknown", "orange", "boxy", "44 x 34 x 7 cm, large")
    assert captions[0].startswith(first) and captions[2] == third


def test_lists_read_as_in_a_sentence() -> None:
    assert joined(["red"]) == "red"
    assert joined(["red", "blue", "white"]) == "red, blue and white"


def test_size_words_state_the_extents_the_longest_first() -> None:
    assert size_words(np.array([0.072, 0.164, 0.213])) == "21 x 16 x 7 cm, medium-sized"
    assert size_words(np.array([0.121, 0.0194, 0.0189])) == "12.1 x 1.9 x 1.9 cm, hand-sized"


def test_a_red_mug_is_described_as_one() -> None:
    mesh = mug()
    language = described(mesh, "coffee mug", visual(mesh, baseColorFactor=[160, 8, 8, 255]))
    assert language.category == "mug" and language.color == "red" and language.material == "ceramic"
    assert "handle" in language.shape and "hot drinks" in language.function
    assert language.caption == "A red mug made of ceramic, about 12 x 10 x 8 cm in size, used for holding hot drinks."
    assert len(language.captions) >= 4 and len(set(language.captions)) == len(language.captions)


def test_a_golden_can_in_a_photo_is_gold_and_a_cardboard_box_is_not() -> None:
    can = cylinder(0.03, 0.12)
    brown = [int(255 * (c / 255) ** 2.2) for c in (112, 84, 40)] + [255]  # a base colour is linear
    seen = subject(can, "can", parts=(visual(can, baseColorFactor=brown),))
    words = RulesAnnotator()
    for photographed, material, color in (
        (True, "tin-plated steel", "gold"), (False, "tin-plated steel", "brown"), (True, "cardboard", "brown"),
    ):  # fmt: skip
        language = words.describe(replace(seen, photographed=photographed), material, can.extents)
        assert language.color == color


def test_only_what_is_all_metal_is_metal() -> None:
    assert all(is_metal(each) for each in ("steel", "tin-plated steel", "stainless steel", "brass or steel", "metal"))
    assert not any(is_metal(each) for each in ("steel and plastic", "aluminium or plastic", "wood", "enamel"))


def test_without_a_color_none_is_claimed() -> None:
    mesh = mug()
    language = described(mesh, "mug", visual(mesh, baseColorFactor=[255, 255, 255, 255]))
    assert language.color.startswith("unknown")
    assert "unknown" not in " ".join(language.captions) and "white" not in " ".join(language.captions)


def test_a_box_is_not_told_to_be_round_as_most_of_its_name_are() -> None:
    assert described(cylinder(0.03, 0.1), "speaker").shape == "cylindrical"
    assert described(trimesh.creation.box((0.2, 0.07, 0.06)), "speaker").shape == "bar-shaped"


def test_without_a_name_the_category_is_unknown_and_the_shape_is_measured() -> None:
    mesh = cylinder(0.03, 0.1)
    language = described(mesh, None, material="unknown material")
    assert language.category == "unknown" and "cylindrical" in language.shape
    assert language.function.startswith("unknown")
    assert language.caption == "An object, about 10 x 6 x 6 cm in size."


def test_a_name_that_the_table_does_not_have_is_kept() -> None:
    assert described(cylinder(0.03, 0.1), "Flux Capacitor").category == "flux capacitor"


def test_all_categories_give_whole_sentences() -> None:
    for prior in load_priors().values():
        size = "10 x 5 x 3 cm, palm-sized"
        captions = write_captions(prior.category, prior, prior.material, "orange", prior.shape, size)
        text = " ".join(captions)
        assert not re.search(r"\b(a|an) (a|an)\b|  |\ba [aeio]\w|{|}| ,|\.\.", text, re.IGNORECASE), text
        assert len(captions) >= 4
        sentences = [caption for caption in captions if not caption.startswith("an orange")]
        assert all(caption[0].isupper() and caption.endswith(".") for caption in sentences), text


@pytest.mark.parametrize(
    ("name", "category"),
    [
        ("coffee mugs", "mug"), ("rubber mallet", "mallet"), ("red sneakers", "sneaker"),
        ("torx screwdriver", "screwdriver"), ("steel pan", "pan"), ("bread knife", "bread knife"), ("salad bowls", "salad bowl"),
        ("garbage can", "garbage can"), ("old frying pan", "frying pan"), ("the shaker", "shaker"),
        ("Cook’s knife", "cook's knife"),
    ],
)  # fmt: skip
def test_the_users_word_is_the_category_where_it_is_another_thing(name: str, category: str) -> None:
    assert described(cylinder(0.03, 0.1), name).category == category


@pytest.mark.parametrize(
    ("category", "material", "caption"),
    [
        ("glass bottle", "glass", "A brown glass bottle, about 27 x 7 x 7 cm in size."),
        ("wooden spoon", "wood", "A brown wooden spoon, about 27 x 7 x 7 cm in size."),
        ("wooden spoon", "bamboo", "A brown wooden spoon made of bamboo, about 27 x 7 x 7 cm in size."),
        (
            "glass bottle",
            "glass and steel",
            "A brown glass bottle made of glass and steel, about 27 x 7 x 7 cm in size.",
        ),
    ],
)
def test_a_material_that_the_name_says_is_not_told_twice(category: str, material: str, caption: str) -> None:
    captions = write_captions(category, None, material, "brown", "cylindrical", "27 x 7 x 7 cm, medium-sized")
    assert captions[0] == caption
    assert len(captions) == len(set(captions))


def test_captions_tell_different_facts() -> None:
    facts = {
        "color": "turquoise", "material": "made of ceramic", "numbers": "10 x 5 x 3 cm", "size": "palm-sized",
        "shape": "cylindrical with a side handle", "use": "holding hot drinks", "name": "mug",
    }  # fmt: skip
    prior = load_priors()["mug"]
    captions = write_captions("mug", prior, "ceramic", "turquoise", facts["shape"], "10 x 5 x 3 cm, palm-sized")
    told = [frozenset(fact for fact, words in facts.items() if words in caption) for caption in captions]
    assert len(captions) == len(set(told)) == 8, told
    assert set().union(*told) == set(facts)


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("ketchup", "ketchup bottle"),
        ("orange juice", "orange juice carton"),
        ("alphabet soup", "soup can"),
        ("pan", "pan"),
    ],
)
def test_what_is_in_a_package_is_told_with_it(said: str, told: str) -> None:
    found = found_by(said)
    assert found is not None and object_noun(*found) == told


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("potted meat can", "A potted meat can "),
        ("canned meat", "A can of canned meat "),
        ("soap bar", "A soap bar "),
        ("soap", "A bar of soap "),
        ("toilet roll", "A toilet roll "),
    ],
)
def test_what_a_name_is_counted_by_is_not_told_twice(said: str, told: str) -> None:
    found = found_by(said)
    assert found is not None
    assert write_captions(object_noun(*found), found[0], "metal", "", "round", "10 x 5 x 3 cm, palm-sized")[
        0
    ].startswith(told)
