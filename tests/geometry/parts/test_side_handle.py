"""A handle is told from a spout that reaches farther, on things whose parts are known by construction."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cup, mug
from manitwin.geometry.parts.shape import measure_shape
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.made import make
from manitwin.models.generators.templates.text import read_text


@pytest.mark.parametrize("category", ["teapot", "watering can", "pitcher", "measuring cup", "mug", "frying pan"])
def test_the_side_handle_is_the_handle(category: str) -> None:
    templates = load_templates()
    for seed in (0, 1):
        made = make(templates[category], read_text(category, templates), np.random.default_rng(seed))
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
