"""A handle is told from a spout that reaches farther, on things whose parts are known by construction."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cup, mug
from manitwin.geometry.parts.features import feature_scores
from manitwin.geometry.parts.part_rules import membership
from manitwin.geometry.parts.shape import SurfacePoints, measure_shape
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.object_sampling import make_object


@pytest.mark.parametrize("category", ["teapot", "watering can", "pitcher", "measuring cup", "mug", "frying pan"])
def test_the_side_handle_is_the_handle(category: str) -> None:
    templates = load_templates()
    for seed in (0, 1):
        made = make_object(templates[category], read_text(category, templates), np.random.default_rng(seed))
        solid = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
        shape = measure_shape(solid, solid.center_mass, "wide", True, np.random.default_rng(seed))
        assert shape.side_handle is not None
        true = next(np.array(point.position_m) for point in made.points if point.label == "handle")
        away = shape.body.azimuth(true[None])[0] - shape.side_handle.azimuth_rad
        assert abs((away + np.pi) % (2 * np.pi) - np.pi) < 0.3, (category, seed)


def _with_a_flower(vessel: trimesh.Trimesh) -> trimesh.Trimesh:
    """What opens upward with a stem of 10 cm in it, whose flower hangs over the rim."""
    rim_m = float(vessel.bounds[1, 2])
    stem = trimesh.creation.cylinder(radius=0.003, segment=[(0, 0, 0.005), (-0.02, 0, rim_m + 0.1)])
    flower = trimesh.creation.icosphere(subdivisions=3, radius=0.02).apply_translation((-0.06, 0.02, rim_m + 0.1))
    bough = trimesh.creation.cylinder(radius=0.003, segment=[(-0.02, 0, rim_m + 0.099), (-0.06, 0.02, rim_m + 0.1)])
    return trimesh.boolean.union([vessel, stem, flower, bough], engine="manifold")


def test_a_flower_over_the_rim_is_no_handle() -> None:
    for vessel, has_one in ((cup(), False), (mug(), True)):
        solid = _with_a_flower(vessel)
        shape = measure_shape(solid, solid.center_mass, "wide", True, np.random.default_rng(0))
        assert len(shape.body.protrusions) == 1 + has_one
        assert (shape.side_handle is not None) == has_one
        if shape.side_handle is not None:
            assert abs(shape.side_handle.azimuth_rad) < 0.2 and shape.side_handle.low_m < 0.1


def _stovetop_kettle(turn_deg: float, *, spout: bool = True) -> trimesh.Trimesh:
    """A round kettle with a knob, a handle that goes over it, and a spout towards +X before it is turned."""
    profile = np.array([[0, 0], [85, 0], [90, 20], [80, 80], [50, 110], [0, 115]]) / 1000
    bars = [([-60, 100], [-50, 150], 7), ([-50, 150], [0, 170], 7), ([0, 170], [45, 150], 7), ([45, 150], [50, 105], 7)]
    bars += [([0, 112], [0, 127], 10)] + ([([75, 55], [110, 85], 10), ([110, 85], [125, 112], 10)] if spout else [])
    solids = [
        trimesh.creation.cylinder(r / 1000, segment=[[p[0] / 1000, 0, p[1] / 1000], [q[0] / 1000, 0, q[1] / 1000]])
        for p, q, r in bars
    ]
    made = trimesh.boolean.union(
        [trimesh.creation.revolve(profile, sections=48), *solids], engine="manifold", check_volume=False
    )
    made.apply_transform(trimesh.transformations.rotation_matrix(np.radians(turn_deg), [0, 0, 1]))
    return made


@pytest.mark.parametrize("turn_deg", [0.0, 70.0, 200.0])
def test_a_handle_that_goes_over_a_kettle_is_its_handle_and_the_spout_beside_it_is_none(turn_deg: float) -> None:
    solid = _stovetop_kettle(turn_deg)
    shape = measure_shape(solid, solid.center_mass, "wide", True, np.random.default_rng(0))
    handle = shape.side_handle
    assert handle is not None and handle.bail is not None
    told = membership("spouted", shape, shape.surface_m)
    assert told is not None and set(told.index) == {0, 1, 2}
    back = trimesh.transformations.rotation_matrix(-np.radians(turn_deg), [0, 0, 1])[:3, :3]
    places = shape.surface_m @ back.T
    assert places[told.index == 1, 2].min() > 0.09 and np.abs(places[told.index == 1, 0]).max() < 0.075
    assert places[told.index == 2, 0].min() > 0.08, "the handle's leg on the spout's side is of the handle"
    points = SurfacePoints(shape.surface_m, np.tile([0.0, 0.0, 1.0], (len(places), 1)), np.full(len(places), 0.01))
    best = {place: places[int(feature_scores(place, shape, points).argmax())] for place in ("handle", "spout", "mouth")}
    assert best["handle"][2] > 0.15 and best["spout"][0] > 0.1
    assert best["mouth"][2] < 0.13 and np.hypot(*best["mouth"][:2]) < 0.05, "its lid is below the handle"


def test_a_knob_or_a_stem_over_a_body_is_no_handle_over_it() -> None:
    for solid in (_with_a_flower(cup()), _with_a_flower(mug()), mug(), cup()):
        assert measure_shape(solid, solid.center_mass, "wide", True, np.random.default_rng(0)).body.over is None
