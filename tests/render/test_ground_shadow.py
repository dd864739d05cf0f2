"""The shade on the ground."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.render.cameras import framing_camera, project
from manitwin.render.ground_shadow import ground_shadow


def box() -> trimesh.Trimesh:
    return trimesh.creation.box([0.06, 0.04, 0.1]).apply_translation([0, 0, 0.05])


def test_shadow_lies_under_the_object_only() -> None:
    camera = framing_camera(
        box().vertices, azimuth_deg=-60, elevation_deg=30, fov_y_deg=60, width_px=200, height_px=200
    )
    shade = ground_shadow(box(), camera)
    (under,), _ = project(np.zeros((1, 3)), camera)
    assert shade[int(under[1]), int(under[0])] < 0.7
    assert shade[0, 0] == 1
    below = framing_camera(box().vertices, azimuth_deg=0, elevation_deg=-30, fov_y_deg=25, width_px=50, height_px=50)
    assert (ground_shadow(box(), below) == 1).all()
