"""What a material in a name changes: material, friction and mass, and where it says nothing."""

from __future__ import annotations

import numpy as np
import pytest

from handmade import cup, cylinder, subject
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.priors import load_materials
from manitwin.models.annotators.rules import RulesAnnotator
from manitwin.models.annotators.stated_matter import prior_in_named_material


@pytest.mark.parametrize(
    ("name", "material", "surface"),
    [
        *(("steel mug", "steel", "steel"), ("A Stainless Steel Mug", "stainless steel", "steel")),
        *(
            ("wooden bowl", "wood", "wood"),
            ("enamel mug", "enamelled steel", "steel"),
            ("plastic cup", "plastic", "plastic"),
        ),
        *(
            ("mug, steel", "steel", "steel"),
            ("mug made of steel", "steel", "steel"),
            ("steel_mug_01", "steel", "steel"),
        ),
        *(
            ("paper cup", "paper", "paper"),
            ("plastic jar", "plastic", "plastic"),
            ("plastic banana", "plastic", "plastic"),
        ),
        *(("cast iron skillet", "cast iron", "steel"), ("steel glass", "steel", "steel")),
        ("red and white steel mug", "steel", "steel"),
    ],
)
def test_a_name_says_the_material(name: str, material: str, surface: str) -> None:
    prior = prior_in_named_material(name)
    assert prior is not None and (prior.material, prior.surface) == (material, surface)
    assert prior.friction_static == load_materials()[surface].friction_static
    assert prior.source.startswith("prior:") and prior.source.endswith(f" of {prior.stated}")


@pytest.mark.parametrize(
    "name",
    [
        *(
            "glass",
            "iron",
            "tin",
            "paper towel",
            "paper clip",
            "rubber duck",
            "silver spoon",
            "golden retriever figurine",
        ),
        *(
            "wood chisel",
            "wood screw",
            "glass cleaner bottle",
            "wood glue bottle",
            "soap dish",
            "felt tip pen",
            "paper punch",
        ),
        *("glass of milk", "mug with a wooden handle", "cup with steel lid", "steel and wood mug", "iron man figurine"),
        *(
            "wooden hammer",
            "steel scissors",
            "vintage mug",
            "glass marble",
            "steel coated mug",
            "tennis ball",
            "marble",
        ),
    ],
)
def test_a_word_that_says_nothing_of_the_whole_changes_nothing(name: str) -> None:
    assert prior_in_named_material(name) == find_prior(name) is not None


def test_without_a_known_name_nothing_is_said() -> None:
    assert (
        prior_in_named_material(None) is None
        and prior_in_named_material("steel wool") is None
        and prior_in_named_material("") is None
    )


def test_a_mug_of_sheet_weighs_what_the_metal_does() -> None:
    wall_m = 0.001
    mesh = cup(0.04, 0.09, wall_m)
    said = RulesAnnotator().estimate_physical(subject(mesh, "steel mug", metric=True))
    assert said.material == "steel" and said.friction_static.source == "prior:mug of steel"
    assert said.mass_kg is not None and said.mass_kg.value == pytest.approx(7850 * float(mesh.volume), rel=0.25)
    assert said.mass_kg.low < 7850 * float(mesh.volume) < said.mass_kg.high
    plain = RulesAnnotator().estimate_physical(subject(mesh, "mug", metric=True))
    assert plain.mass_kg is not None and plain.material == "ceramic"


def test_materials_of_one_mesh_weigh_as_their_densities_order_them() -> None:
    mesh = cup(0.04, 0.09, 0.003)
    masses = []
    for material in ("paper", "wooden", "plastic", "ceramic", "steel"):
        mass = RulesAnnotator().estimate_physical(subject(mesh, f"{material} cup", metric=True)).mass_kg
        assert mass is not None and mass.low <= mass.value <= mass.high
        masses.append(mass.value)
    assert masses[4] > masses[3] > masses[2] and masses[3] > masses[1] and masses[3] > masses[0]


def test_a_steel_mug_as_thick_as_one_of_clay_is_hollow_between_two_skins() -> None:
    thick = cup(0.04, 0.09, 0.006)
    mass = RulesAnnotator().estimate_physical(subject(thick, "steel mug", metric=True)).mass_kg
    assert mass is not None and 0.15 < mass.value < 0.45 < 7850 * float(thick.volume)  # such mugs weigh 0.2 to 0.4 kg


def test_imitations_of_food_are_light() -> None:
    # YCB 011_banana, of plastic: 0.066 kg; 0.19 m long
    prior = prior_in_named_material("plastic banana")
    assert prior is not None and prior.mass_kg.low < 0.066 < prior.mass_kg.high
    assert prior.mass_kg.typical == pytest.approx(0.066, rel=0.3)


def test_what_is_full_weighs_its_contents_whatever_it_is_of() -> None:
    usual, steel = find_prior("water bottle"), prior_in_named_material("stainless steel water bottle")
    assert usual is not None and steel is not None and steel.material == "stainless steel"
    assert steel.mass_kg.typical == pytest.approx(usual.mass_kg.typical, rel=0.1)
    assert steel.mass_kg.low > 3 * usual.mass_kg.low, "an empty one is of steel alone"
    full = RulesAnnotator().estimate_physical(subject(cylinder(0.033, 0.2), "steel water bottle", metric=True)).mass_kg
    assert full is not None and full.value == pytest.approx(np.pi * 0.033**2 * 0.2 * 1000, rel=0.3)


@pytest.mark.parametrize(
    "name", ["wooden comb", "wooden ruler", "oak cutting board", "wooden dice", "walnut bowl", "wooden tray"]
)
def test_what_is_of_wood_is_no_denser_than_wood(name: str) -> None:
    prior = prior_in_named_material(name)
    assert prior is not None and prior.bulk_density_kg_m3 is not None
    assert 200 < prior.bulk_density_kg_m3.typical <= 720 and prior.bulk_density_kg_m3.high < 1100


def test_words_tell_the_material_once() -> None:
    mesh = cup(0.04, 0.09, 0.003)
    seen = subject(mesh, "steel mug", metric=True)
    language = RulesAnnotator().describe(seen, "steel", mesh.extents)
    assert language.category == "mug" and language.material == "steel" and "made of steel" in language.caption
