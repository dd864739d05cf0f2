"""Cups with an ear: what their measures say of lip, foot, ear and wall is so of the solid."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold
from scipy.spatial import cKDTree

from manitwin.models.generators.templates.capacity import capacity_m3
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.catalog.cup_shapes import CupSide
from manitwin.models.generators.templates.fitting.fit import build_fitted_object
from manitwin.models.generators.templates.template import Model

CUPS = ("tea cup", "cup and saucer")
WALL_M = 0.003


def built(category: str, **measures: float) -> tuple[Model, dict[str, float]]:
    template = load_templates()[category]
    wanted = template.typical_measures() | measures
    return template.build(**wanted), wanted


def side(**measures: float) -> CupSide:
    usual = {"radius_m": 0.042, "height_m": 0.06, "wide_m": 0.035, "belly_m": 0.025, "foot_m": 0.023, "lip_m": 0.002}
    return CupSide(**(usual | measures), wall_m=WALL_M)


@pytest.mark.parametrize("category", CUPS)
def test_every_corner_of_the_intervals_is_one_closed_solid_with_one_ear(category: str) -> None:
    template = load_templates()[category]
    rng = np.random.default_rng(3)
    for _ in range(24):
        measures = {name: float(rng.choice([each.low, each.high])) for name, each in template.measures.items()}
        mesh = template.build(**measures).assembly.mesh()
        solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        assert solid.is_watertight and solid.body_count == 1, measures
        assert solid.euler_number == 0, measures  # one finger goes through, and the hollow is open
        assert {"body", "handle", "inside", "rim", "base"} <= set(mesh.names), measures


@pytest.mark.parametrize("measures", [{}, {"lip_m": 0.006}, {"wide_m": 0.041}, {"foot_m": 0.034, "belly_m": 0.015}])
def test_the_wall_is_as_thick_where_it_leans_as_where_it_is_upright(measures: dict[str, float]) -> None:
    cup = side(**measures)
    outer, inner = (trimesh.Trimesh(*_arrays(solid)) for solid in cup.solids())
    points = inner.vertices[
        (inner.vertices[:, 2] > cup.floor_m + 1e-6) & (inner.vertices[:, 2] < cup.height_m - WALL_M)
    ]
    away = cKDTree(trimesh.sample.sample_surface(outer, 200_000, seed=0)[0]).query(points)[0]
    assert len(points) > 500
    assert away.min() > 0.9 * WALL_M and np.median(away) == pytest.approx(WALL_M, rel=0.05)


def _arrays(solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    mesh = solid.to_mesh()
    return np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts)


def test_a_flared_lip_leans_outward_and_the_bottom_narrows_to_the_foot() -> None:
    plain, flared = side(lip_m=0.0), side(lip_m=0.006)
    assert plain.radius_at(0.06) == pytest.approx(flared.radius_at(0.06)) == pytest.approx(0.042)

    def lean(cup: CupSide) -> float:
        return cup.radius_at(0.06) - cup.radius_at(0.055)

    assert lean(flared) > lean(plain) + 0.0015
    heights = np.linspace(0.004, 0.025, 12)
    radii = np.array([plain.radius_at(z) for z in heights])
    assert radii[0] < 0.027 and radii[-1] == pytest.approx(0.035, abs=2e-4)
    assert (np.diff(radii) > 0).all() and (np.diff(radii, 2) < 1e-9).all()  # round: ever steeper


@pytest.mark.parametrize("category", CUPS)
@pytest.mark.parametrize("join", [0.25, 0.5])
def test_the_ear_leaves_near_the_rim_and_comes_back_where_it_is_said_to(category: str, join: float) -> None:
    model, measures = built(category, join=join, hook=1.0)
    mesh = model.assembly.mesh()
    ear, cup = (np.unique(mesh.faces[mesh.faces_of(part)]) for part in ("handle", "body"))
    at_wall = mesh.vertices[np.intersect1d(ear, cup)][:, 2]
    height = measures["rim"] * measures["width_m"] * measures.get("cup", 1.0)
    low = float(mesh.vertices[:, 2].max()) - height
    assert 0.8 * height < at_wall.max() - low < height
    lower = at_wall[at_wall < 0.5 * (at_wall.min() + at_wall.max())]
    assert lower.mean() - low == pytest.approx(join * height, abs=0.06 * height)


def test_a_question_mark_reaches_farthest_above_the_middle_of_the_ear() -> None:
    def widest(hook: float) -> float:
        model, measures = built("tea cup", hook=hook)
        place = next(point for point in model.points if point.label == "handle").position_m
        return place[2] / (measures["rim"] * measures["width_m"])

    even, mark = widest(0.0), widest(1.0)
    assert mark > even + 0.04
    assert even == pytest.approx(0.5 * (0.87 + load_templates()["tea cup"].measures["join"].typical), abs=0.06)


@pytest.mark.parametrize("measures", [{}, {"flare": 0.14, "belly": 0.95}, {"bottom": 0.62, "rim": 0.9}])
def test_a_cup_holds_what_is_within_its_walls(measures: dict[str, float]) -> None:
    template = load_templates()["tea cup"]
    wanted = template.typical_measures() | measures
    thing = build_fitted_object(template, wanted)
    height, radius = wanted["rim"] * wanted["width_m"], 0.5 * wanted["width_m"]
    ratios = [wanted[name] for name in ("belly", "bottom", "taper", "flare")]
    lengths = np.array(ratios) * [radius, height, radius, radius]
    cup = CupSide(radius, height, *lengths.tolist(), wanted["wall_m"])
    hollow = cup.solids()[1].trim_by_plane((0, 0, -1), -height)
    scale = float(np.ptp(thing.mesh.vertices[:, 2])) / height
    held = capacity_m3(thing)
    assert held is not None and held == pytest.approx(scale**3 * hollow.volume(), rel=0.02)
