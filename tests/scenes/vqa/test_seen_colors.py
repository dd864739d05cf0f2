"""A colour is said of an object where the picture shows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.annotators.surface_color import are_similar_colors
from manitwin.render.cameras import Camera, look_at
from manitwin.render.raycast import merge_parts
from manitwin.scenes.vqa.visible_colors import is_color_visible, leading


@dataclass
class Painted:
    """What ``is_color_visible`` reads of a twin."""

    visual: list[trimesh.Trimesh]


def plate(z_m: float, rgb: tuple[int, int, int]) -> trimesh.Trimesh:
    mesh = trimesh.creation.box(
        extents=(0.1, 0.1, 0.02), transform=trimesh.transformations.translation_matrix([0, 0, z_m])
    )
    mesh.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(baseColorFactor=[*rgb, 255])
    )
    return mesh


def test_a_sponge_is_not_called_by_the_colour_of_the_side_it_lies_on() -> None:
    sponge = Painted([plate(-0.01, (140, 80, 30)), plate(0.01, (10, 80, 20))])
    caster = RayCaster(merge_parts(sponge.visual))

    def shown(color: str, height_m: float) -> bool:
        camera = Camera(look_at(np.array([0.001, 0, height_m]), np.zeros(3)), 0.5, 64, 64)
        mask = np.zeros((64, 64), bool)
        mask[28:36, 28:36] = True
        return is_color_visible(color, sponge, caster, np.eye(4), camera, mask)

    below = "tan" if shown("tan", -0.4) else "brown"
    assert shown(below, -0.4) and not shown(below, 0.4)
    assert shown("dark green", 0.4) and not shown("dark green", -0.4)


def test_a_colour_leads_by_more_where_it_is_grey() -> None:
    assert leading([("tan", 63), ("dark green", 37)]) == "tan"
    assert leading([("light grey", 63), ("dark red", 37)]) is None
    assert leading([("red", 51), ("blue", 49)]) is None


def test_colours_that_may_be_taken_for_each_other_are_near() -> None:
    near = [("dark grey", "black"), ("white", "light grey"), ("tan", "brown"), ("dark red", "red"), ("tan", "beige")]
    far = [("yellow", "black"), ("tan", "dark grey"), ("red", "green"), ("light grey", "black"), ("yellow", "red")]
    assert all(are_similar_colors(*pair) and are_similar_colors(*pair[::-1]) for pair in near)
    assert not any(are_similar_colors(*pair) or are_similar_colors(*pair[::-1]) for pair in far)
