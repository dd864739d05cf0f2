"""Furniture and lights of a scene's record, as the renderer takes them."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from itertools import product

import numpy as np
import trimesh

from manitwin.formats.meshes.textures import bake_transform
from manitwin.geometry.poses import transform
from manitwin.render.procedural_textures import ProceduralTexture, procedural_texture, textured_box
from manitwin.render.scene_lighting import DirectionalLight, Lighting
from manitwin.render.scene_renderer import SceneRenderer, Surroundings
from manitwin.scenes.scene import Furniture, Light, SurfaceBox

TEXTURE_VARIANTS = 8
"""Of each material: making one takes a third of a CPU-second, so that they are kept and used again."""


LEGGED, LEG_HALF_M = "table", 0.03


def add_furniture(renderer: SceneRenderer, furniture: Furniture, *, seed: int) -> None:
    """Add the boxes of a piece of furniture under their names, in their order; ``seed`` chooses the textures.

    Boxes of one material share a texture, each with its own stretch of it; the box ``table`` gets legs. Raises UsageError for
    an unknown material.
    """
    for box in furniture.boxes:
        texture = procedural_texture(box.material, seed % TEXTURE_VARIANTS)
        code = zlib.crc32(box.name.encode())
        offset_m = (code % 997 / 997, code // 997 % 991 / 991)
        parts = [textured_box(np.array(box.half_extents_m), texture, offset_m=offset_m)]
        if box.name == LEGGED:
            parts += _legs(box, texture)
        renderer.add(box.name, parts, transform(translation=np.array(box.center_m)))


def _legs(table: SurfaceBox, texture: ProceduralTexture) -> list[trimesh.Trimesh]:
    """Return four legs down to the room's floor, in the table's frame: they are of its looks only."""
    x, y, z = table.half_extents_m
    half_m = np.array([LEG_HALF_M, LEG_HALF_M, (table.center_m[2] - z - Surroundings().floor_z_m) / 2])
    if half_m[2] <= 0:
        return []
    legs = []
    for side_x, side_y in product((-1, 1), repeat=2):
        leg = textured_box(half_m, texture, offset_m=(side_x * 0.3, side_y * 0.4))
        corner = np.array([side_x * (x - 2 * LEG_HALF_M), side_y * (y - 2 * LEG_HALF_M), -z - half_m[2]])
        legs.append(bake_transform(leg, transform(translation=corner)))
    return legs


def lighting_of(ambient: tuple[float, float, float], lights: Iterable[Light]) -> Lighting:
    """Return the lights of a scene's record."""
    return Lighting(
        np.array(ambient),
        tuple(DirectionalLight(np.array(x.direction), np.array(x.color), x.casts_shadow) for x in lights),
    )
