"""Mass and size by rule, against closed forms and objects that were weighed."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from handmade import cup, cylinder, subject
from manitwin.formats.meshes.read import read_mesh
from manitwin.geometry.poses import transform
from manitwin.geometry.repair.cascade import repair
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.annotators.rules import RulesAnnotator, estimate_physical


def mass(mesh: trimesh.Trimesh, name: str | None, *, metric: bool = True):
    return RulesAnnotator().estimate_physical(subject(mesh, name, metric=metric)).mass_kg


def test_a_full_drink_can_weighs_what_its_contents_and_metal_do() -> None:
    # 330 ml at 1.04 kg/l and 13 g of aluminium; a 330 ml can is 66 mm wide and 115 mm high.
    estimate = mass(cylinder(0.033, 0.115), "soda can")
    assert estimate.value == pytest.approx(0.356, rel=0.12)
    assert estimate.low <= 0.013 * 1.5 and estimate.high >= 0.36


def test_a_full_vessel_weighs_what_its_volume_does_and_an_empty_one_its_walls() -> None:
    """That some are empty makes neither opinion of a full one unsure: a bottle of 0.31 l was said to weigh 0.23 kg full."""
    profile = np.array([(0, 0), (30, 0), (30, 100), (12, 120), (12, 137), (0, 137)]) / 1000
    bottle = trimesh.creation.revolve(profile, sections=48)
    full = mass(bottle, "water bottle")
    assert full.value == pytest.approx(990 * bottle.volume, rel=0.03)
    assert full.low < 0.02 and full.high < 1.2 * full.value
    walls = np.array([(0, 0), (30, 0), (30, 137), (29, 137), (29, 1), (0, 1)]) / 1000
    empty = mass(trimesh.creation.revolve(walls, sections=48), "water bottle")
    assert empty.value < 0.5 * full.value


def test_a_larger_one_weighs_more() -> None:
    small, large = mass(cylinder(0.03, 0.09), "can"), mass(cylinder(0.045, 0.135), "can")
    assert large.value > 2 * small.value


def test_mass_stays_in_the_categorys_interval_where_the_volume_says_more() -> None:
    filled_in = cylinder(0.04, 0.1)
    assert 2300 * filled_in.volume > find_prior("mug").mass_kg.high
    estimate = mass(filled_in, "mug")
    assert (
        find_prior("mug").mass_kg.low
        <= estimate.low
        <= estimate.value
        <= estimate.high
        <= find_prior("mug").mass_kg.high
    )


def test_a_volume_that_no_such_thing_has_leaves_the_mass_open_and_not_certain() -> None:
    prior, block = find_prior("mug"), trimesh.creation.box([0.12, 0.12, 0.12])
    assert prior.bulk_density_kg_m3 is not None and prior.bulk_density_kg_m3.low * block.volume > prior.mass_kg.high
    heavy = mass(block, "mug")
    assert heavy.value == prior.mass_kg.high and heavy.low == prior.mass_kg.typical and heavy.high > 1.2 * heavy.value
    sliver = trimesh.creation.box([0.12, 0.02, 0.002])
    assert prior.bulk_density_kg_m3.high * sliver.volume < prior.mass_kg.low
    light = mass(sliver, "mug")
    assert light.low < light.value < light.high


def test_an_answer_at_the_end_of_what_its_volume_leaves_open_is_not_sure_of_itself() -> None:
    """Small headphones of little matter: their volume and the lightest such things left 90 to 98 g, and nothing between."""
    prior = find_prior("headphones")
    assert prior.bulk_density_kg_m3 is not None
    slight = trimesh.creation.box([0.13, 0.12, 0.0978 / (prior.bulk_density_kg_m3.high * 0.13 * 0.12)])
    estimate = mass(slight, "headphones")
    assert estimate.value < 0.0978 and estimate.high > 1.2 * estimate.value


def test_interval_goes_on_beyond_the_answer_where_size_and_volume_contradict_each_other() -> None:
    thin = trimesh.creation.box([0.27, 0.1, 0.007])  # as long as a large toy, with the matter of a small one
    prior = find_prior("toy")
    assert prior.bulk_density_kg_m3 is not None
    estimate = mass(thin, "toy")
    assert estimate.value > prior.bulk_density_kg_m3.high * thin.volume
    assert 1.5 * estimate.value < estimate.high <= prior.mass_kg.high
    block = trimesh.creation.box([0.2, 0.15, 0.1])
    agreed = mass(block, "toy")
    assert agreed.high == min(prior.bulk_density_kg_m3.high * block.volume, prior.mass_kg.high), "the same as before"


def test_a_volume_by_a_guessed_size_says_less_than_one_by_a_known_one() -> None:
    prior = find_prior("drill")
    assert prior.bulk_density_kg_m3 is not None
    side_m = (0.7 * prior.mass_kg.typical / prior.bulk_density_kg_m3.typical / prior.longest_axis_m.typical) ** 0.5
    light = trimesh.creation.box([prior.longest_axis_m.typical, side_m, side_m])  # as long as usual, of less matter
    known, guessed = mass(light, "drill"), mass(light, "drill", metric=False)
    assert known.value < guessed.value < prior.mass_kg.typical < guessed.high
    # log-normal: the mean of both by their inverse variances, that of the volume with nine times the size's
    spread = {
        name: np.log(interval.high / interval.low) / 3.29
        for name, interval in (
            ("mass", prior.mass_kg),
            ("density", prior.bulk_density_kg_m3),
            ("size", prior.longest_axis_m),
        )
    }
    by_size, by_volume = (0.6 * spread["mass"]) ** -2, 1 / (spread["density"] ** 2 + (3 * spread["size"]) ** 2)
    lessened = 0.7 ** (by_volume / (by_size + by_volume))
    assert guessed.value == pytest.approx(lessened * prior.mass_kg.typical)


@pytest.mark.parametrize("share", [0.3, 0.6, 2.5])
def test_by_a_guessed_size_no_thing_is_denser_than_such_things_are(share: float) -> None:
    prior = find_prior("pliers")
    bulk = prior.bulk_density_kg_m3
    assert bulk is not None
    length_m = prior.longest_axis_m.typical
    side_m = (share * prior.mass_kg.typical / bulk.typical / length_m) ** 0.5
    slender = trimesh.creation.box([length_m, side_m, side_m])
    guessed = mass(slender, "pliers", metric=False)
    assert bulk.low <= guessed.value / slender.volume <= bulk.high * (1 + 1e-9)
    assert guessed.low <= guessed.value <= guessed.high and guessed.high > 0.9 * prior.mass_kg.typical


@pytest.mark.parametrize("name", ["drill", "pliers", "serving tray"])
def test_interval_by_a_guessed_size_holds_what_larger_and_smaller_ones_weigh(name: str) -> None:
    prior = find_prior(name)
    assert prior.bulk_density_kg_m3 is not None
    length_m = prior.longest_axis_m.typical
    side_m = (prior.mass_kg.typical / prior.bulk_density_kg_m3.typical / length_m) ** 0.5
    usual = trimesh.creation.box([length_m, side_m, side_m])
    guessed = mass(usual, name, metric=False)
    for end_m in (prior.longest_axis_m.low, prior.longest_axis_m.high):
        size = (end_m / length_m) ** 0.5  # half of the way, in natural logs
        assert guessed.low <= mass(usual.copy().apply_scale(size), name).value <= guessed.high


def test_a_thing_without_a_name_has_a_wide_interval_and_says_so() -> None:
    mesh = cylinder(0.03, 0.1)
    estimate = mass(mesh, None)
    assert estimate.source == "prior:unknown"
    assert estimate.low == pytest.approx(100 * mesh.volume) and estimate.high == pytest.approx(2000 * mesh.volume)


def test_a_thing_without_a_name_is_about_as_large_and_heavy_as_what_it_may_be() -> None:
    mesh = cylinder(0.5, 1.5)
    guessed = replace(subject(mesh, None, metric=False), likely=(("orange", 0.41), ("lemon", 0.12), ("apple", 0.03)))
    said, anything = estimate_physical(guessed, None), estimate_physical(replace(guessed, likely=()), None)
    assert anything.longest_axis_m.source == "prior:unknown" and anything.longest_axis_m.value == 0.15
    assert said.longest_axis_m.source == said.mass_kg.source == "prior:likeliest"
    orange = find_prior("orange").longest_axis_m.typical
    assert orange < said.longest_axis_m.value < 0.12 and said.longest_axis_m.low < orange < said.longest_axis_m.high
    assert said.longest_axis_m.high > 0.3, "with the rest it may be anything"
    assert said.bulk_density_kg_m3.value > anything.bulk_density_kg_m3.value, "fruit is denser than most things"
    assert estimate_physical(guessed, find_prior("can")).longest_axis_m.source == "prior:can", "a name counts first"


def test_only_a_mesh_of_unknown_scale_gets_a_size() -> None:
    mesh = cylinder(0.5, 1.5)
    assert estimate_physical(subject(mesh, "can"), find_prior("can")).longest_axis_m is None
    said = estimate_physical(subject(mesh, "can", metric=False), find_prior("can"))
    assert said.longest_axis_m.source == "prior:can"
    assert said.longest_axis_m.value == find_prior("can").longest_axis_m.typical
    assert find_prior("can").mass_kg.low <= said.mass_kg.value <= find_prior("can").mass_kg.high


def test_a_closed_skin_of_a_hollow_thing_gets_a_wall_and_a_full_one_none() -> None:
    ball = trimesh.creation.icosphere(radius=0.033)
    assert estimate_physical(subject(ball, "tennis ball"), find_prior("tennis ball")).wall_thickness_m == 0.003
    assert estimate_physical(subject(ball, "baseball"), find_prior("baseball")).wall_thickness_m is None
    assert estimate_physical(subject(cup(), "cup"), find_prior("cup")).wall_thickness_m is None


def _book(leaves: int, opened: bool = False) -> trimesh.Trimesh:
    """A closed book of 15 x 21 x 3 cm: covers, a spine and leaves of 0.1 mm; opened: its two halves make a roof."""
    boxes = [((0.002, 0.21, 0.03), (-0.0755, 0, 0.015))]
    boxes += [((0.15, 0.21, 0.002), (0, 0, z)) for z in (0.001, 0.029)]
    boxes += [((0.144, 0.204, 1e-4), (-0.003, 0, z)) for z in np.linspace(0.003, 0.027, leaves)]
    sheets = [trimesh.creation.box(size, transform(translation=np.array(place))) for size, place in boxes]
    for sheet in sheets[1::2] if opened else []:
        sheet.apply_transform(trimesh.transformations.rotation_matrix(1.2, [0, 1, 0], [-0.0755, 0, 0]))
    return trimesh.util.concatenate(sheets)


@pytest.mark.parametrize("leaves", [12, 40, 90])
def test_a_book_whose_leaves_are_modelled_weighs_what_one_solid_book_does(leaves: int) -> None:
    solid = trimesh.creation.box((0.152, 0.21, 0.03))
    whole, leafy, opened = (
        RulesAnnotator().estimate_physical(subject(mesh, "book")).mass_kg.value
        for mesh in (solid, _book(leaves), _book(leaves, opened=True))
    )
    assert leafy == pytest.approx(whole, rel=0.05) and opened < 0.8 * whole


def test_every_number_says_where_it_is_from() -> None:
    mesh = trimesh.creation.box([0.05, 0.04, 0.03])
    for prior in list(load_priors().values())[::6]:
        said = estimate_physical(subject(mesh, None), prior)
        for estimate in (said.mass_kg, said.friction_static, said.friction_dynamic, said.restitution):
            assert np.isfinite(estimate.value) and estimate.value > 0
            assert estimate.source.startswith("prior:") or estimate.source == "density*volume"


@pytest.mark.slow
@pytest.mark.shared_data
def test_objects_that_were_weighed_are_in_the_interval_and_most_within_half(shared_data: Path) -> None:
    with open(shared_data / "manifest.csv", newline="") as table:
        rows = [row for row in csv.DictReader(table) if row["kind"] == "mesh" and row["mass_kg"]]
    assert len(rows) == 13
    near = 0
    for row in rows:
        parts = read_mesh(shared_data / row["file"]).parts
        vertices, faces = trimesh.util.append_faces([p.vertices for p in parts], [p.faces for p in parts])
        estimate = mass(repair(trimesh.Trimesh(vertices, faces, process=False)).mesh, row["category"])
        true = float(row["mass_kg"])
        assert estimate.low <= true <= estimate.high, (row["object_name"], estimate)
        near += max(estimate.value / true, true / estimate.value) < 1.5
    assert near >= 9


@pytest.mark.shared_data
def test_photographed_objects_that_were_weighed_are_in_their_categorys_interval(shared_data: Path) -> None:
    with open(shared_data / "manifest.csv", newline="") as table:
        rows = [row for row in csv.DictReader(table) if row["kind"] == "photo" and row["mass_kg"]]
    outside = [
        (row["category"], row["mass_kg"])
        for row in rows
        if not find_prior(row["category"]).mass_kg.low
        <= float(row["mass_kg"])
        <= find_prior(row["category"]).mass_kg.high
    ]
    assert len(rows) >= 6 and len(outside) <= 1, outside
