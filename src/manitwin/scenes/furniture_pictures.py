"""Furniture and lights of a scene's record as input of the renderer."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from functools import lru_cache
from itertools import product

import numpy as np

from manitwin.geometry.poses import transform
from manitwin.render.drawable import Drawable, prepare_drawable
from manitwin.render.procedural_textures import TexturedBox, procedural_texture, textured_boxes
from manitwin.render.scene_lighting import DirectionalLight, Lighting
from manitwin.render.scene_renderer import SceneRenderer, Surroundings
from manitwin.scenes.scene import Furniture, Light, SurfaceBox

TEXTURE_VARIANTS = 8
"""Number of textures for each material: making one takes a third of a CPU-second, so they are cached and reused."""


LEGGED, LEG_HALF_M = "table", 0.03
BOXES_KEPT = 8
"""Number of cached boxes, some 10 MB each: most episodes use one of a few tables."""


def add_furniture(renderer: SceneRenderer, furniture: Furniture, *, seed: int) -> None:
    """Add the boxes of a piece of furniture under their names, in order; ``seed`` selects the textures.

    Boxes of one material share a texture at different offsets; the box ``table`` gets legs. Raises UsageError for an unknown
    material.
    """
    for box in furniture.boxes:
        pose = transform(translation=np.array(box.center_m))
        renderer.add(box.name, _box_drawable(box, seed % TEXTURE_VARIANTS), pose)


@lru_cache(maxsize=BOXES_KEPT)
def _box_drawable(box: SurfaceBox, variant: int) -> Drawable:
    code = zlib.crc32(box.name.encode())
    offset_m = (code % 997 / 997, code // 997 % 991 / 991)
    boxes = [TexturedBox(np.array(box.half_extents_m), offset_m=offset_m)]
    if box.name == LEGGED:
        boxes += _legs(box)
    return prepare_drawable([textured_boxes(boxes, procedural_texture(box.material, variant))])


def _legs(table: SurfaceBox) -> list[TexturedBox]:
    """Return four legs down to the floor of the room, in the table's frame; they have no collision shape."""
    x, y, z = table.half_extents_m
    half_m = np.array([LEG_HALF_M, LEG_HALF_M, (table.center_m[2] - z - Surroundings().floor_z_m) / 2])
    if half_m[2] <= 0:
        return []
    return [
        TexturedBox(
            half_m,
            center_m=(side_x * (x - 2 * LEG_HALF_M), side_y * (y - 2 * LEG_HALF_M), -z - half_m[2]),
            offset_m=(side_x * 0.3, side_y * 0.4),
        )
        for side_x, side_y in product((-1, 1), repeat=2)
    ]


def render_lighting(ambient: tuple[float, float, float], lights: Iterable[Light]) -> Lighting:
    """Return the lights of a scene's record as renderer lighting."""
    return Lighting(
        np.array(ambient),
        tuple(DirectionalLight(np.array(x.direction), np.array(x.color), x.casts_shadow) for x in lights),
    )
