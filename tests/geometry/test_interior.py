"""Integrals over the inside of solids, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.interior import columns_of, mass_properties_of


def test_a_box_is_filled_evenly() -> None:
    box = trimesh.creation.box([0.03, 0.05, 0.2])
    centers, volumes = columns_of(box)
    assert volumes.sum() == pytest.approx(0.03 * 0.05 * 0.2, rel=1e-6)
    found = mass_properties_of(centers, 0.5 * volumes / volumes.sum(), 3e-4)
    expected = 0.5 / 12 * np.diag([0.05**2 + 0.2**2, 0.03**2 + 0.2**2, 0.03**2 + 0.05**2])
    assert found.center_of_mass_m == pytest.approx([0, 0, 0], abs=1e-6)
    assert found.inertia_kg_m2 == pytest.approx(expected, rel=1e-3, abs=1e-9)


def test_a_hole_is_empty() -> None:
    tube = trimesh.creation.annulus(r_min=0.02, r_max=0.03, height=0.1, sections=96)
    centers, volumes = columns_of(tube)
    assert volumes.sum() == pytest.approx(tube.volume, rel=0.01)
    assert np.hypot(*centers[:, :2].T).min() > 0.0195


def test_a_head_and_handle_of_unlike_matter_balance_as_the_lever_says() -> None:
    handle = trimesh.creation.box([0.02, 0.02, 0.3])
    head = trimesh.creation.box([0.1, 0.03, 0.03], transform=trimesh.transformations.translation_matrix([0, 0, 0.164]))
    hammer = trimesh.boolean.union([handle, head], engine="manifold")
    centers, volumes = columns_of(hammer)
    masses = volumes * np.where(centers[:, 2] > 0.149, 7850.0, 650.0)
    steel, wood = 7850 * 0.1 * 0.03 * 0.03, 650 * 0.02 * 0.02 * 0.299
    found = mass_properties_of(centers, masses, float(hammer.volume))
    assert found.center_of_mass_m[2] == pytest.approx((steel * 0.164 - wood * 0.0005) / (steel + wood), abs=1.5e-3)
