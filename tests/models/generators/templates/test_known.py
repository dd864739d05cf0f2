"""What a template knows of its things: mass properties against closed forms, points on the surface."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.geometry.solids.shapes import box, cylinder
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.ground_truth import mass_properties, material_words, object_import_record
from manitwin.models.generators.templates.object_sampling import make_object

TEMPLATES = load_templates()


def test_two_boxes_of_two_densities_have_the_inertia_of_the_parallel_axis_theorem() -> None:
    light, heavy = box(0.1, 0.1, 0.1), box(0.1, 0.1, 0.1).translate((0.1, 0, 0))
    mass, center, inertia = mass_properties([(light, 1000.0), (heavy, 3000.0)])
    assert mass == pytest.approx(4.0) and center == pytest.approx([0.075, 0, 0.05])
    own = (1.0 + 3.0) * 0.1**2 / 6
    apart = 1.0 * 0.075**2 + 3.0 * 0.025**2
    assert np.diag(inertia) == pytest.approx([own, own + apart, own + apart])
    assert inertia - np.diag(np.diag(inertia)) == pytest.approx(np.zeros((3, 3)), abs=1e-9)


def test_head_of_steel_draws_the_centre_of_a_hammer_to_it() -> None:
    wanted = read_text("hammer with a wooden handle", TEMPLATES)
    thing = make_object(TEMPLATES["hammer"], wanted, np.random.default_rng(5))
    known = object_import_record(thing, "hammer with a wooden handle")
    assert known.mass_kg == pytest.approx(sum(thing.masses_kg.values()), rel=1e-6)
    assert known.center_of_mass_m is not None
    along = np.array(known.center_of_mass_m)[0] / np.ptp(thing.mesh.vertices[:, 0])
    assert along > 0.2, "well on the head's side of the middle"
    assert known.material in ("steel and wood", "wood and steel") and [p.label for p in known.functional_points] == [
        "striking face",
        "claw",
        "handle",
    ]


@pytest.mark.parametrize(
    ("text", "materials"),
    [
        ("red ceramic mug", {"ceramic"}),
        ("tablet", {"plastic", "electronics"}),
        ("light bulb", {"glass", "brass"}),
        ("chef's knife with a wooden handle", {"stainless steel", "wood"}),
    ],
)
def test_a_thing_is_made_of_what_most_of_its_mass_and_surface_are(text: str, materials: set[str]) -> None:
    wanted = read_text(text, TEMPLATES)
    thing = make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(0))
    assert set(material_words(thing).split(" and ")) == materials


@pytest.mark.parametrize(
    ("text", "category"),
    [
        ("a black skillet, 24 cm", "skillet"), ("a bread knife with a wooden handle", "bread knife"), ("a red coffee mug", "mug"),
        ("stainless steel frying pan", "frying pan"),
    ],
)  # fmt: skip
def test_a_thing_is_called_as_its_text_does(text: str, category: str) -> None:
    wanted = read_text(text, TEMPLATES)
    known = object_import_record(make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(0)), text)
    assert known.prior_key == category and known.source == f"template:{wanted.category}"


@pytest.mark.parametrize(
    ("text", "part"), [("whisk", "handle"), ("hand mirror", "frame"), ("pet bowl", "body"), ("ladle", "handle")]
)
def test_parts_of_sheet_weigh_less_than_their_volume_of_metal_and_as_much_of_other_matter(text: str, part: str) -> None:
    brass, plastic = (
        make_object(
            TEMPLATES[text], read_text(f"{matter} {text} with a {matter} {part}", TEMPLATES), np.random.default_rng(3)
        )
        for matter in ("brass", "plastic")
    )
    assert brass.masses_kg[part] < 0.6 * 8500 / 1050 * plastic.masses_kg[part], (
        "hollow: walls follow the matter besides"
    )
    usual = find_prior(text)
    assert usual is not None and sum(brass.masses_kg.values()) < usual.mass_kg.high
    whole = sum(density * float(solid.volume()) for solid, density in brass.solids)
    assert sum(brass.masses_kg.values()) == pytest.approx(whole), "what the inertia is made of weighs as much"


def test_point_of_an_opening_is_on_the_rim() -> None:
    thing = make_object(TEMPLATES["bowl"], read_text("bowl", TEMPLATES), np.random.default_rng(1))
    opening = object_import_record(thing, "bowl").functional_points[0]
    height = thing.mesh.vertices[:, 2].max()
    assert opening.label == "opening" and opening.position_m[2] > 0.9 * height
    assert np.hypot(*opening.position_m[:2]) > 0.04


def test_full_cylinder_weighs_its_density() -> None:
    mass, center, inertia = mass_properties([(cylinder(0.03, 0.2, sides=200), 1000.0)])
    assert mass == pytest.approx(np.pi * 0.03**2 * 0.2 * 1000, rel=1e-3) and center[2] == pytest.approx(0.1)
    assert inertia[2, 2] == pytest.approx(0.5 * mass * 0.03**2, rel=2e-3)


def test_a_dumbbell_under_rubber_is_of_iron_and_rubber() -> None:
    """Its weights have the density of iron whatever they are coated with: 'rubber' alone was told of 2 kg in a hand's size."""
    for text, materials in (
        ("a dumbbell with blue rubber weights", {"iron", "rubber"}),
        ("an iron dumbbell", {"iron"}),
    ):
        made = make_object(TEMPLATES["dumbbell"], read_text(text, TEMPLATES), np.random.default_rng(0))
        assert set(material_words(made).split(" and ")) == materials
