"""What the wall of an open thing says of its matter, against the densities of the materials that its prior names."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cup, subject
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import Interval
from manitwin.models.annotators.priors import load_materials
from manitwin.models.annotators.rules import estimate_physical
from manitwin.models.annotators.walls import density_by_wall, wall_materials


def bin_of(wall_m: float, side_m: float = 0.15, height_m: float = 0.17) -> trimesh.Trimesh:
    """An open round container of one wall all over, in metres."""
    return cup(side_m / 2, height_m, wall_m)


def test_a_container_of_a_fingers_wall_is_no_moulded_plastic_and_one_of_a_millimetre_no_pottery() -> None:
    prior, materials = find_prior("container"), load_materials()
    thick, thin = (density_by_wall(prior, bin_of(wall_m), 0) for wall_m in (0.007, 0.0018))
    assert thick is not None and thin is not None
    assert thick.typical == pytest.approx(materials["ceramic"].density_kg_m3.typical, rel=0.2)
    assert thin.low <= materials["plastic"].density_kg_m3.typical < thin.high and thin.typical < thick.typical


def test_what_the_wall_leaves_open_stays_in_the_priors_interval() -> None:
    prior = find_prior("container")
    for wall_m in (0.0005, 0.001, 0.003, 0.006, 0.009):
        found = density_by_wall(prior, bin_of(wall_m), 0)
        assert found is not None and prior.bulk_density_kg_m3 is not None
        assert prior.bulk_density_kg_m3.low <= found.low <= found.typical <= found.high <= prior.bulk_density_kg_m3.high


def test_walls_of_materials_that_are_all_denser_than_such_things_are_as_dense_as_the_densest() -> None:
    """Where all materials are taken for the end of the interval their mean was beyond it by rounding, which stopped a build."""
    prior, solid = find_prior("container"), bin_of(0.003)
    for high in np.linspace(300, 700, 41):
        held = Interval(low=80, typical=200, high=float(high))
        found = density_by_wall(prior.model_copy(update={"bulk_density_kg_m3": held}), solid, 0)
        assert found is not None and found.low <= found.typical <= found.high == held.high


def test_a_wall_says_nothing_of_one_matter_of_a_solid_and_of_what_is_no_open_ware() -> None:
    block = trimesh.creation.box([0.15, 0.15, 0.15])
    assert density_by_wall(find_prior("container"), block, 0) is None, "it has no wall"
    assert density_by_wall(find_prior("mug"), bin_of(0.004), 0) is None, "mugs are ceramic"
    assert density_by_wall(find_prior("screwdriver"), bin_of(0.004), 0) is None


def test_metal_is_steel_or_aluminium() -> None:
    assert set(wall_materials(find_prior("container"))) == {"plastic", "ceramic", "steel", "aluminium"}


def test_a_pottery_container_weighs_its_matter_where_its_size_is_known() -> None:
    solid = bin_of(0.006)
    known = estimate_physical(subject(solid, "container"), find_prior("container")).mass_kg
    guessed = estimate_physical(subject(solid, "container", metric=False), find_prior("container")).mass_kg
    assert known is not None and guessed is not None
    true_kg = load_materials()["ceramic"].density_kg_m3.typical * float(solid.volume)
    assert abs(np.log(known.value / true_kg)) < np.log(1.6) < abs(np.log(guessed.value / true_kg))
    assert known.low <= true_kg <= known.high
