"""The stem of a round thing, wherever it is, and things that have none."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from handmade import candidates
from manitwin.geometry.parts.features import feature_scores
from manitwin.geometry.parts.shape import measure_shape, surface_points
from manitwin.geometry.parts.stem import find_stem
from manitwin.geometry.sampling import sample_surface
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.object_sampling import make_object


def _found(mesh: trimesh.Trimesh):  # type: ignore[no-untyped-def]
    surface_m = sample_surface(mesh, 6000, np.random.default_rng(0))[0]
    return find_stem(surface_m, np.ptp(mesh.vertices, axis=0))


def _fruit(*directions: tuple[float, float, float], squeezed: float = 1.0) -> trimesh.Trimesh:
    """Return a ball of 7 cm with stems that stick out by 1 cm."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.035)
    ball.apply_scale([1, 1, squeezed])
    stems = [
        trimesh.creation.cylinder(0.004, segment=[np.zeros(3), 0.045 * np.array(direction)]) for direction in directions
    ]
    return trimesh.boolean.union([ball, *stems]) if stems else ball


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.6, 0.0, -0.8)])
@pytest.mark.parametrize("squeezed", [1.0, 0.8])
def test_a_stem_is_found_wherever_it_is(direction: tuple[float, float, float], squeezed: float) -> None:
    stem = _found(_fruit(direction, squeezed=squeezed))
    assert stem is not None and stem.direction @ direction > np.cos(np.radians(6))
    assert stem.reach_m == pytest.approx(0.045, abs=0.002)


@pytest.mark.parametrize(
    "mesh",
    [
        _fruit(),
        _fruit(squeezed=0.7),
        _fruit((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)),
        _fruit((1.0, 0.0, 0.0), (-0.5, 0.866, 0.0), (-0.5, -0.866, 0.0)),
        trimesh.creation.box((0.05, 0.05, 0.05)),
        trimesh.creation.cylinder(0.03, 0.06),
        trimesh.creation.cylinder(0.005, 0.1),
    ],
    ids=["ball", "squeezed", "two", "three", "cube", "cylinder", "rod"],
)
def test_what_has_no_one_stem_has_none(mesh: trimesh.Trimesh) -> None:
    assert _found(mesh) is None


@pytest.mark.parametrize("degrees", [0, 100, 180])
def test_the_stem_end_of_an_onion_that_lies_is_not_its_top(degrees: float) -> None:
    templates = load_templates()
    made = make_object(templates["onion"], read_text("onion", templates), np.random.default_rng(3))
    mesh = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    turned = Rotation.from_euler("x", degrees, degrees=True).as_matrix()
    mesh.vertices = mesh.vertices @ turned.T
    shape = measure_shape(mesh, mesh.center_mass, "wide", False, np.random.default_rng(0))
    points = surface_points(mesh, *candidates(mesh))
    scores = feature_scores("stem", shape, points)
    assert scores is not None
    out = points.positions_m[int(scores.argmax())] - mesh.bounds.mean(axis=0)
    assert out @ turned[:, 2] / np.linalg.norm(out) > np.cos(np.radians(25))
