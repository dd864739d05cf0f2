"""Exposure by Lambert's law."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.render.scene_lighting import LUMINANCE, STUDIO, WHITE_PAPER, DirectionalLight, Lighting


def level_luminance(lighting: Lighting) -> float:
    """What white level paper sends out: E cos(a) / pi for each light, and the ambient light."""
    total = lighting.ambient.astype(float).copy()
    for light in lighting.lights:
        cosine = -light.direction[2] / np.linalg.norm(light.direction)
        total += light.color * max(cosine, 0) / np.pi
    return float(LUMINANCE @ total)


def test_white_paper_is_exposed_as_promised_under_any_light() -> None:
    rng = np.random.default_rng(0)
    for _ in range(10):
        lights = tuple(
            DirectionalLight(np.append(rng.normal(size=2), -rng.uniform(0.2, 2)), rng.uniform(0, 5, 3))
            for _ in range(3)
        )
        exposed = Lighting(rng.uniform(0.01, 2, 3), lights).with_auto_exposure()
        assert level_luminance(exposed) == pytest.approx(WHITE_PAPER)


def test_ratios_and_colours_of_lights_stay() -> None:
    exposed = STUDIO.with_auto_exposure()
    factor = exposed.ambient / STUDIO.ambient
    np.testing.assert_allclose(factor, factor[0])
    for before, after in zip(STUDIO.lights, exposed.lights, strict=True):
        np.testing.assert_allclose(after.color, before.color * factor[0])
        np.testing.assert_allclose(after.direction, before.direction / np.linalg.norm(before.direction))
        assert after.casts_shadow == before.casts_shadow


def test_light_from_below_counts_nothing_and_darkness_stays_dark() -> None:
    below = Lighting(np.zeros(3), (DirectionalLight(np.array([0.0, 0, 1]), np.ones(3)),))
    np.testing.assert_array_equal(below.with_auto_exposure().lights[0].color, np.ones(3))
