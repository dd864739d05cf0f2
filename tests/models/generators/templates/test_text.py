"""What sentences ask templates for."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.errors import UsageError
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.looks import COLORS, MATERIALS
from manitwin.models.generators.templates.made import make
from manitwin.models.generators.templates.text import MAX_CHARACTERS, Wanted, Wish, read_text

TEMPLATES = load_templates()


def read(text: str) -> Wanted:
    return read_text(text, TEMPLATES)


@pytest.mark.parametrize(
    ("text", "category"),
    [
        ("mug", "mug"),
        ("a mug", "mug"),
        ("Two MUGS!", "mug"),
        ("a cup of tea", "cup"),
        ("the red coffee mug", "mug"),
        ("smartphone", "mobile phone"),
        ("chef's knife", "chef's knife"),
        ("a stainless steel frying pan with a wooden handle", "frying pan"),
        ("claw hammer", "hammer"),
        ("wooden spoon", "cooking spoon"),
        ("ballpoint pen", "pen"),
        ("a jam jar", "jar"),
        ("a travel mug", "thermos"),
        ("a tooth brush", "toothbrush"),
        ("a No. 2 pencil", "pencil"),
    ],
)
def test_category_is_the_thing_that_is_named(text: str, category: str) -> None:
    assert read(text).category == category


def test_words_before_and_after_the_thing_describe_it() -> None:
    red = tuple(int(COLORS["red"][i : i + 2], 16) / 255 for i in (0, 2, 4))
    for text in ("a red ceramic mug", "mug, red ceramic", "mug in red ceramic"):
        wish = read(text).wishes[""]
        assert wish.rgb == red and wish.material == MATERIALS["ceramic"]


@pytest.mark.parametrize(
    ("text", "material"),
    [
        ("a wooden spoon", "wood"),
        ("a red paper cup", "paper"),
        ("a bamboo wooden spoon", "bamboo"),
        ("a glass jar", "glass"),
        ("a wood chisel", None),
        ("a soap dispenser", None),
        ("a red wine glass", None),
    ],
)
def test_a_material_that_the_name_says_is_asked_for_where_such_things_are_of_it(
    text: str, material: str | None
) -> None:
    asked = read(text).wishes.get("", Wish()).material
    assert asked == (None if material is None else MATERIALS[material])


def test_a_wooden_spoon_is_of_wood_and_as_heavy_as_one() -> None:
    for seed in range(4):
        made = make(TEMPLATES["cooking spoon"], read("a wooden spoon, 30 cm long"), np.random.default_rng(seed))
        assert {look.material for look in made.looks.values()} == {"wood"}
        assert 0.02 < sum(made.masses_kg.values()) < 0.06  # of beech, 30 cm long: 30 to 50 g


def test_parts_are_described_by_their_name() -> None:
    wanted = read("a small blue mug with a wooden handle")
    assert wanted.relative is not None and wanted.relative < 0.5
    assert wanted.wishes["handle"].material == MATERIALS["wood"] and wanted.wishes[""].rgb is not None


@pytest.mark.parametrize(
    ("text", "lengths"),
    [
        ("a mug, 9 cm", {"": 0.09}),
        ("mug 95 mm tall", {"height": 0.095}),
        ("a plate 10 inches wide", {"width": 0.254}),
        ("ruler, 0.3 m long", {"length": 0.3}),
        ("a 12cm glass", {"": 0.12}),
        ("a 1,5 cm dice", {"": 0.015}),
        ("a mug, 9,5 cm tall", {"height": 0.095}),
        ("a rolling pin of 1,000 mm", {"": 1.0}),
        ("a mug 9 centimetres tall", {"height": 0.09}),
        ("a ruler, 0.3 meters", {"": 0.3}),
        ('a 4" ruler', {"": 0.1016}),
        ("a plate 10 in. wide", {"width": 0.254}),
        ("a 1 foot ruler", {"": 0.3048}),
        ("a mug 5 1/2 inches tall", {"height": 0.1397}),
        ("a mug with a height of 9 cm", {"height": 0.09}),
        ("a mug 9 cm in height", {"height": 0.09}),
        ("a red mug with a wooden handle, 9 cm tall", {"height": 0.09}),
        ("a mug of the 70's", {}),
        ("an umbrella 3' long", {"length": 0.9144}),
    ],
)
def test_lengths_are_read_with_their_unit_and_direction(text: str, lengths: dict[str, float]) -> None:
    assert read(text).lengths_m == pytest.approx(lengths)


def test_light_and_dark_move_a_colour() -> None:
    light, plain, dark = (read(f"{shade} blue mug").wishes[""].rgb for shade in ("light", "", "dark"))
    assert light is not None and plain is not None and dark is not None
    assert sum(light) > sum(plain) > sum(dark)


def test_words_that_say_nothing_to_a_template_are_kept_apart() -> None:
    assert read("a vintage mug").unused == ("vintage",)


@pytest.mark.parametrize(
    "text", ["a hamer", "a unicorn", "", "9 cm", "red", "with a handle", "x" * (MAX_CHARACTERS + 1)]
)
def test_text_that_names_no_template_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(UsageError) as caught:
        read(text)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 700


@pytest.mark.parametrize(
    "text",
    [
        *("a magnifying glass", "garlic bulb", "a muffin tin", "a VR headset", "a table tennis ball", "a glass marble"),
        *("a measuring tape", "a name plate", "a soap dish"),
    ],
)
def test_another_thing_whose_name_ends_as_a_templates_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="no template makes"):
        read(text)


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("a box 10 cm long, 6 cm wide and 4 cm tall", "several lengths"),
        ("a box, 20 x 15 x 10 cm", "several lengths"),
        ("a knife with a 12 cm long handle", "length of a part"),
        ("a two-litre soda bottle", "a volume"),
        ("a 2 kg dumbbell", "a mass"),
        ("a mug without a handle", "what a thing is not"),
    ],
)
def test_what_a_template_cannot_be_told_is_refused_and_not_left_out(text: str, cause: str) -> None:
    with pytest.raises(UsageError, match=cause):
        read(text)


def test_a_part_is_called_by_its_plural_where_that_is_its_name() -> None:
    wanted = read("a red toothbrush with white bristles")
    made = make(TEMPLATES["toothbrush"], wanted, np.random.default_rng(0))
    white = tuple(int(COLORS["white"][i : i + 2], 16) / 255 for i in (0, 2, 4))
    assert made.looks["bristles"].rgb == pytest.approx(white)


def test_nearest_categories_are_named() -> None:
    with pytest.raises(UsageError, match=r"did you mean hammer"):
        read("a hamer")


def test_stated_size_is_the_size() -> None:
    for text, axis, size_m in (
        ("mug 10 cm tall", 2, 0.10),
        ("a plate 26 cm wide", 0, 0.26),
        ("ruler 30 cm long", 0, 0.30),
    ):
        wanted = read(text)
        thing = make(TEMPLATES[wanted.category], wanted, np.random.default_rng(0))
        assert np.ptp(thing.mesh.vertices, axis=0)[axis] == pytest.approx(size_m, rel=1e-6)


@pytest.mark.parametrize("text", ["a mug 3 m tall", "hammer, 2 mm", "a mug with a red wheel"])
def test_what_no_such_thing_has_is_refused(text: str) -> None:
    wanted = read(text)
    with pytest.raises(UsageError):
        make(TEMPLATES[wanted.category], wanted, np.random.default_rng(0))
