"""A handle is told from a spout that reaches farther, on things whose parts are known by construction."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

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
