"""The colours and materials that a text asks for."""

from __future__ import annotations

import numpy as np
import pytest
from told_templates import TEMPLATES, read, whole

from manitwin.errors import UsageError
from manitwin.models.annotators.priors import load_priors
from manitwin.models.generators.templates.look_phrases import LookRequest
from manitwin.models.generators.templates.looks import COLORS, MATERIALS
from manitwin.models.generators.templates.object_sampling import make_object


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
    asked = read(text).wishes.get("", LookRequest()).material
    assert asked == (None if material is None else MATERIALS[material])


def test_a_wooden_spoon_is_of_wood_and_as_heavy_as_one() -> None:
    for seed in range(4):
        made = make_object(TEMPLATES["cooking spoon"], read("a wooden spoon, 30 cm long"), np.random.default_rng(seed))
        assert {look.material for look in made.looks.values()} == {"wood"}
        assert 0.02 < sum(made.masses_kg.values()) < 0.06  # of beech, 30 cm long: 30 to 50 g


@pytest.mark.parametrize(
    ("text", "category", "color"),
    [
        ("an orange ball", "ball", "orange"),
        ("an orange mug", "mug", "orange"),
        ("a mug, orange", "mug", "orange"),
        ("a mug painted orange", "mug", "orange"),
        ("a mug that is orange", "mug", "orange"),
        ("a large mug orange", "mug", "orange"),
        ("a glass, orange", "glass", "orange"),
        ("a peach colored cup", "cup", "peach"),
        ("a vase, peach", "vase", "peach"),
        ("a lemon yellow bowl", "bowl", "yellow"),
        ("a mug, lemon yellow", "mug", "yellow"),
        ("a chocolate brown mug", "mug", "brown"),
        ("a mug, chocolate brown", "mug", "brown"),
        ("an eggshell white vase", "vase", "white"),
        ("a red apple", "apple", "red"),
        ("a green apple", "apple", "green"),
        ("a white egg", "egg", "white"),
        ("an orange orange", "orange", "orange"),
    ],
)
def test_fruit_that_is_a_colour_is_one_where_another_thing_is_named(text: str, category: str, color: str) -> None:
    wanted = read(text)
    rgb = tuple(int(COLORS[color][at : at + 2], 16) / 255 for at in (0, 2, 4))
    assert wanted.category == category and wanted.wishes[""].rgb == pytest.approx(rgb)


def test_imitations_of_food_have_its_colours_and_weigh_what_they_are_of() -> None:
    for seed in range(4):
        plastic = make_object(TEMPLATES["banana"], read("a plastic banana"), np.random.default_rng(seed)).looks["body"]
        red, green, blue = plastic.rgb
        assert plastic.material == "plastic" and min(red, green) > 2 * blue
        wooden = make_object(TEMPLATES["apple"], read("a wooden apple"), np.random.default_rng(seed)).looks["body"]
        assert wooden.material == "wood" and wooden.density_kg_m3 == MATERIALS["wood"].density_kg_m3


def test_light_and_dark_move_a_colour() -> None:
    light, plain, dark = (read(f"{shade} blue mug").wishes[""].rgb for shade in ("light", "", "dark"))
    assert light is not None and plain is not None and dark is not None
    assert sum(light) > sum(plain) > sum(dark)


@pytest.mark.parametrize(
    ("text", "material"),
    [
        *(
            ("an enamel mug", "enamel"),
            ("an enamelled pot", "enamel"),
            ("an enameled cast iron pot", "enamelled cast iron"),
        ),
        *(("a copper mug", "copper"), ("a terracotta plate", "earthenware"), ("an aluminum cup", "aluminium")),
        *(
            ("an acrylic cup", "acrylic"),
            ("an oak spoon", "oak"),
            ("a wooden oak spoon", "oak"),
            ("a pine box", "pine"),
        ),
        *(
            ("a marble mortar", "marble"),
            ("a mug made of recycled plastic", "plastic"),
            ("a bone china cup", "porcelain"),
        ),
    ],
)
def test_words_for_matter_are_known(text: str, material: str) -> None:
    assert whole(text).material == MATERIALS[material]


def test_an_enamel_mug_is_of_thin_steel() -> None:
    made = make_object(TEMPLATES["mug"], read("an enamel mug, 9 cm tall"), np.random.default_rng(0))
    assert all(look.surface == "steel" and look.metallic == 0 for look in made.looks.values())
    assert made.measures["wall_m"] < 0.002 and 0.1 < sum(made.masses_kg.values()) < 0.4


@pytest.mark.parametrize(
    "text",
    [
        *("a brush for wood", "a glass of red wine", "a bottle of soap", "a box of paper", "a silver plated spoon"),
        *("a cup of black coffee", "a leather chisel"),
    ],
)
def test_what_a_thing_holds_or_is_for_says_nothing_of_what_it_is_made_of(text: str) -> None:
    asked = read(text)
    assert asked.wishes.get("", LookRequest()).material is None and asked.unused
    if "silver" not in text:
        assert asked.wishes == {}


def test_a_colour_that_is_a_material_too_is_the_latter_where_no_other_is_said() -> None:
    assert whole("a copper mug").material == MATERIALS["copper"]
    mixed = whole("a copper ceramic mug")
    assert mixed.material == MATERIALS["ceramic"] and mixed.rgb == pytest.approx(MATERIALS["copper"].rgb)
    colored = whole("a copper coloured mug")
    assert colored.material is None and colored.rgb == pytest.approx(MATERIALS["copper"].rgb)


def test_colours_of_two_words_are_one() -> None:
    assert whole("a navy blue mug").rgb == whole("a navy mug").rgb
    assert whole("a rose gold bracelet").rgb not in (whole("a gold bracelet").rgb, whole("a rose bracelet").rgb)
    assert whole("an off-white mug").rgb != whole("a white mug").rgb


def test_metal_colours_and_clear_choose_the_material() -> None:
    for seed in range(4):
        spoon = make_object(TEMPLATES["spoon"], read("a silver spoon"), np.random.default_rng(seed))
        assert {look.surface for look in spoon.looks.values()} == {"steel"}
        cup = make_object(TEMPLATES["cup"], read("a clear cup"), np.random.default_rng(seed))
        assert {look.surface for look in cup.looks.values()} == {"plastic"}


@pytest.mark.parametrize("text", ["a red and white mug", "a steel and wood knife", "a red mug, blue"])
def test_two_colours_or_materials_of_one_part_are_refused(text: str) -> None:
    with pytest.raises(UsageError, match="for one object"):
        read(text)


def test_of_a_stated_material_the_colour_is_drawn() -> None:
    for text in ("a ceramic mug", "a plastic bowl", "a silicone spatula", "an enamel mug"):
        wanted = read(text)
        drawn = [make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(seed)) for seed in range(8)]
        assert len({next(iter(each.looks.values())).rgb for each in drawn}) > 2
        assert len({next(iter(each.looks.values())).material for each in drawn}) == 1
        again = make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(3))
        assert again.looks == drawn[3].looks and again.masses_kg == drawn[3].masses_kg
    steel = [make_object(TEMPLATES["mug"], read("a steel mug"), np.random.default_rng(seed)) for seed in range(4)]
    assert {next(iter(each.looks.values())).rgb for each in steel} == {MATERIALS["steel"].rgb}


def test_all_of_a_wooden_spatula_is_of_wood_that_is_seen() -> None:
    for seed in range(6):
        made = make_object(TEMPLATES["spatula"], read("a wooden spatula"), np.random.default_rng(seed))
        assert {look.surface for look in made.looks.values()} == {"wood"}
        brush = make_object(
            TEMPLATES["paint brush"], read("a paint brush with a wooden handle"), np.random.default_rng(seed)
        )
        red, _, blue = brush.looks["handle"].rgb
        assert red - blue < 0.4, "no red paint"


def test_behind_of_silver_and_gold_are_metals() -> None:
    assert whole("a goblet made of silver").material == MATERIALS["sterling silver"]
    assert whole("a ring of gold").material == MATERIALS["solid gold"]
    assert whole("a tube of cream") == LookRequest(), "what is in it"
    assert read("a half full glass").category == "glass" and read("a cup full of tea").unused == ("tea",)


def test_nobody_paints_copper() -> None:
    for seed in range(6):
        made = make_object(TEMPLATES["watering can"], read("a green watering can"), np.random.default_rng(seed))
        assert {look.material for look in made.looks.values()}.isdisjoint({"copper", "brass"})


def test_dark_and_light_wood_are_so() -> None:
    wood = sum(MATERIALS["wood"].rgb)
    assert sum(whole("a dark wood bowl").rgb or ()) < wood < sum(whole("a light wooden bowl").rgb or ())


def test_a_frying_pan_of_any_metal_is_of_plate() -> None:
    interval = load_priors()["frying pan"].mass_kg  # 0.35 kg to 3.2 kg; YCB's skillet has 0.95 kg
    for text in ("a frying pan", "an aluminium frying pan", "a stainless steel skillet", "a cast iron skillet"):
        for seed in range(6):
            made = make_object(TEMPLATES["frying pan"], read(text), np.random.default_rng(seed))
            assert interval.low <= sum(made.masses_kg.values()) <= interval.high, (text, seed)
