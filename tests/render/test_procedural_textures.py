"""Procedural textures: seamless, of their seed, and of the material that they are named for."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.errors import UsageError
from manitwin.render.procedural_textures import (
    TexturedBox,
    periodic_noise,
    procedural_texture,
    textured_box,
    textured_boxes,
)

MATERIALS = ("cloth", "marble", "metal", "wood")


@pytest.mark.parametrize("material", MATERIALS)
def test_texture_goes_on_across_its_edges(material: str) -> None:
    color = procedural_texture(material, 5, size_px=256).color.astype(float)
    for axis in (0, 1):
        inside = np.abs(np.diff(color, axis=axis)).mean(axis=(1 - axis, 2))
        across = np.abs(color.take(0, axis) - color.take(-1, axis)).mean()
        assert across <= 1.3 * inside.max()


def test_seam_would_be_noticed() -> None:
    color = procedural_texture("marble", 5, size_px=256).color[:, :200].astype(float)
    inside = np.abs(np.diff(color, axis=1)).mean(axis=(0, 2))
    assert np.abs(color[:, 0] - color[:, -1]).mean() > 1.3 * inside.max()


@pytest.mark.parametrize("material", MATERIALS)
def test_seed_decides_the_pixels(material: str) -> None:
    first = procedural_texture(material, 1, size_px=128)
    procedural_texture.cache_clear()
    again, other = (procedural_texture(material, seed, size_px=128) for seed in (1, 2))
    assert first is not again
    np.testing.assert_array_equal(first.color, again.color)
    np.testing.assert_array_equal(first.roughness, again.roughness)
    assert np.abs(first.color.astype(int) - other.color).mean() > 1


def test_only_metal_is_metallic_and_marble_is_the_smoothest() -> None:
    made = {material: procedural_texture(material, 0, size_px=128) for material in MATERIALS}
    assert {material for material, texture in made.items() if texture.metallic == 1} == {"metal"}
    rough = {material: float(texture.roughness.mean()) for material, texture in made.items()}
    assert rough["marble"] < rough["metal"] < rough["wood"] < rough["cloth"]


def test_brushed_metal_and_wood_vary_less_along_their_grain() -> None:
    for material in ("metal", "wood"):
        color = procedural_texture(material, 3, size_px=256).color.astype(float)
        along, across = (np.abs(np.diff(color, axis=axis)).mean() for axis in (1, 0))
        assert along < 0.6 * across


def test_noise_has_mean_zero_and_deviation_one() -> None:
    noise = periodic_noise(np.random.default_rng(0), 128, wavelengths=(0.5, 0.5))
    assert noise.shape == (128, 128)
    assert abs(noise.mean()) < 1e-6
    assert noise.std() == pytest.approx(1, abs=1e-4)


def test_unknown_material_names_the_nearest() -> None:
    with pytest.raises(UsageError, match="did you mean 'wood'"):
        procedural_texture("wodd", 0)


def test_boxes_of_one_texture_are_as_each_alone_where_it_stands() -> None:
    wood = procedural_texture("wood", 0, size_px=64)
    boxes = [
        TexturedBox(np.array([0.3, 0.2, 0.02]), offset_m=(0.1, 0.2)),
        TexturedBox(np.array([0.02, 0.02, 0.3]), center_m=(0.2, -0.1, -0.32), offset_m=(-0.3, 0.4)),
    ]
    whole = textured_boxes(boxes, wood)
    assert len(whole.vertices) == 48 and len(whole.faces) == 24
    for number, box in enumerate(boxes):
        alone = textured_box(box.half_extents_m, wood, offset_m=box.offset_m)
        vertices = slice(24 * number, 24 * number + 24)
        assert np.allclose(whole.vertices[vertices], alone.vertices + box.center_m)
        assert np.allclose(whole.visual.uv[vertices], alone.visual.uv)
        assert np.allclose(whole.vertex_normals[vertices], alone.vertex_normals)
        assert np.array_equal(whole.faces[(whole.faces // 24 == number).all(1)] - 24 * number, alone.faces)
