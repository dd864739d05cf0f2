"""Cameras of fits: what is turned with its view is seen where it was."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.view import View, apply_yaw, normalised


@pytest.mark.parametrize("category", ["apple", "potato", "pumpkin", "soccer ball"])
@pytest.mark.parametrize("yaw_rad", [0.6, 2.2, -1.4])
def test_what_is_turned_is_seen_where_it_was(category: str, yaw_rad: float) -> None:
    template = load_templates()[category]
    vertices = template.build(**template.typical_measures()).assembly.mesh().vertices
    view = View(yaw_rad, 0.5, 0.1, 0.2, 0.7, 0.05, -0.02)
    before, distance = view.project(normalised(vertices)[0])
    ahead, turned = apply_yaw(view, vertices)
    after, its_distance = ahead.project(normalised(turned)[0])
    assert ahead.yaw_rad == 0 and np.abs(before - after).max() < 0.004  # of the longer side of its box in the photo
    towards = np.argmin(distance)
    assert its_distance[towards] < np.quantile(its_distance, 0.02)
