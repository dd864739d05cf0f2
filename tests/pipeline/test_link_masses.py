"""The mass properties of an imported thing's links, and who said them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from manitwin.pipeline import links
from manitwin.pipeline.links import link_masses
from manitwin.twin.link_records import Articulation, GivenLink

EVEN_M2 = np.diag([1e-4, 2e-4, 2.5e-4])


def given(name: str, inertia_kg_m2: np.ndarray | None) -> GivenLink:
    said = None if inertia_kg_m2 is None else inertia_kg_m2.tolist()
    return GivenLink(name=name, mass_kg=0.2, center_of_mass_m=(0.0, 0.0, 0.01), inertia_kg_m2=said)


def test_an_inertia_that_a_link_lacks_is_that_of_an_even_filling_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    stated = np.diag([3e-5, 4e-5, 5e-5])
    shape = {"inertia_m2": EVEN_M2.tolist(), "volume_m3": 1e-4, "center_of_mass_m": [0.0, 0.0, 0.0], "hulls": [0]}
    fields = {"collision": {"links": [shape, shape]}, "physical": {"mass_kg": {"value": 0.4}}}
    monkeypatch.setattr(links, "read_given", lambda draft: SimpleNamespace(source="imported:urdf"))
    moving = Articulation.model_construct(links=[given("body", stated), given("finger", None)], joints=[])
    body, finger = link_masses(SimpleNamespace(field=fields.__getitem__), moving)  # type: ignore[arg-type]
    assert body.source == "imported:urdf" and np.allclose(body.inertia_kg_m2, stated)
    assert finger.source == "imported:urdf, inertia of an even filling"
    assert np.allclose(finger.inertia_kg_m2, 0.2 * EVEN_M2) and finger.mass_kg == 0.2
