"""Colours on their way to the renderer."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.render.surfaces import linear_to_srgb, plain_part, render_surface, srgb_to_linear


def test_plain_colour_reaches_the_renderer_as_linear_light() -> None:
    part = render_surface(plain_part(trimesh.creation.box(), (188, 188, 188)))
    assert part.color == pytest.approx((0.503, 0.503, 0.503), abs=0.004)  # sRGB 188 is half the light
    values = np.linspace(0, 1, 50)
    assert linear_to_srgb(srgb_to_linear(values)) == pytest.approx(values, abs=1e-6)
