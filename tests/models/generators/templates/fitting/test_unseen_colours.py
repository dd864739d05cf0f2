"""Colours of what no photo shows: the median of the nearest that are seen, some places at a time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from manitwin.models.generators.templates.fitting import texturing


@pytest.mark.parametrize("count", [1, 7, 48])
def test_medians_of_some_places_at_a_time_are_those_of_each(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    rng = np.random.default_rng(2)
    seen, places, colours = rng.random((90, 3)), rng.random((41, 3)), 255 * rng.random((90, 3))
    monkeypatch.setattr(texturing, "_NEAR_AT_ONCE", 3 * count)
    found = texturing._nearest_medians(colours, cKDTree(seen), places, count)
    for place, colour in zip(places, found, strict=True):
        nearest = np.argsort(np.linalg.norm(seen - place, axis=1))[:count]
        assert colour == pytest.approx(np.median(colours[nearest], axis=0))
