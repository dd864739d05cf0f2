"""Colours on their way to the renderer."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.formats.meshes.textures import make_part, pbr_material
from manitwin.render.surfaces import MAX_TEXTURE_PX, linear_to_srgb, plain_part, render_surface, srgb_to_linear


def test_plain_colour_reaches_the_renderer_as_linear_light() -> None:
    part = render_surface(plain_part(trimesh.creation.box(), (188, 188, 188)))
    assert part.color == pytest.approx((0.503, 0.503, 0.503), abs=0.004)  # sRGB 188 is half the light
    values = np.linspace(0, 1, 50)
    assert linear_to_srgb(srgb_to_linear(values)) == pytest.approx(values, abs=1e-6)


def square(share: float, side_px: int = 512) -> trimesh.Trimesh:
    """A square of 0.1 m that takes a square of so much of its texture's side."""
    corners = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    vertices = 0.1 * np.column_stack([corners[:, 0], np.zeros(4), corners[:, 1]])
    material = pbr_material(base_color_texture=Image.new("RGB", (side_px, side_px), (200, 90, 10)))
    return make_part(vertices, np.array([[0, 1, 2], [0, 2, 3]]), material=material, name="square", uv=share * corners)


@pytest.mark.parametrize(("share", "side_px"), [(1.0, 100), (0.5, 200), (0.25, 400), (0.1, 512), (0.0, 512)])
def test_textures_have_the_texels_that_are_seen_of_them(share: float, side_px: int) -> None:
    """Of a texture of which a thing takes a tenth of the side, or a point, as of a palette, all is kept."""
    color_map = render_surface(square(share), texels_a_unit=1000.0).color_map
    assert color_map is not None and color_map.shape == (side_px, side_px, 4)


def test_textures_are_at_most_as_large_as_is_of_use() -> None:
    color_map = render_surface(square(1.0, 2 * MAX_TEXTURE_PX)).color_map
    assert color_map is not None and color_map.shape[0] == MAX_TEXTURE_PX
