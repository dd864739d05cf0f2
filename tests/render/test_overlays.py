"""Visible edges of a box, and its shade on the ground."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import framing_camera, project
from manitwin.render.overlays import ground_shadow, visible_edges
from manitwin.render.raycast import cast_camera


def test_wireframe_shows_the_nine_near_edges_of_a_box() -> None:
    mesh = trimesh.creation.box([0.1, 0.1, 0.1])
    camera = framing_camera(mesh.vertices, azimuth_deg=40, elevation_deg=30, fov_y_deg=25, width_px=200, height_px=200)
    depth, _, _ = cast_camera(RayCaster(mesh), camera)
    cover = visible_edges(mesh, camera, depth)
    hidden = mesh.vertices[np.linalg.norm(mesh.vertices - camera.position, axis=1).argmax()]
    edges = mesh.vertices[mesh.edges_unique]
    sides = edges[np.isclose(np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1), 0.1)]  # without the diagonals
    assert len(sides) == 12
    for a, b in sides:
        pixels, _ = project(a + np.linspace(0.1, 0.9, 30)[:, None] * (b - a), camera)
        drawn = np.mean([cover[int(y) - 1 : int(y) + 2, int(x) - 1 : int(x) + 2].max() > 0.2 for x, y in pixels])
        if np.allclose(a, hidden) or np.allclose(b, hidden):
            assert drawn < 0.5
        else:
            assert drawn > 0.85


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
