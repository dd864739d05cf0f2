"""Bodies of revolution seen from above, whose profile, elevation, hollow and handles are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.solids.shapes import cylinder, lathe
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.lift.hint import ShapeHint
from manitwin.models.generators.lift.lifting import lift
from manitwin.models.generators.lift.revolution import (
    end_elevations,
    half_widths,
    largest_profile,
    projected_half_widths,
)
from manitwin.models.generators.lift.surface import tip_angle_deg, to_manifold
from manitwin.render.cameras import framing_camera
from manitwin.render.raycast import cast_camera


def _mesh(solid) -> trimesh.Trimesh:  # type: ignore[no-untyped-def]
    mesh = solid.to_mesh()
    return trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts), process=False)


def _photo(mesh: trimesh.Trimesh, elevation_deg: float, *, azimuth_deg: float = -90.0) -> np.ndarray:
    """An RGBA picture from far away, shaded by direction."""
    points = np.asarray(mesh.vertices)
    camera = framing_camera(
        points, azimuth_deg=azimuth_deg, elevation_deg=elevation_deg, fov_y_deg=4, width_px=400, height_px=400
    )
    _, normals, face = cast_camera(RayCaster(mesh), camera)
    grey = np.clip(70 + 110 * np.abs(normals @ np.array([0.3, 0.4, 0.9])), 0, 255).astype(np.uint8)
    return np.dstack([grey, grey, grey, np.where(face >= 0, 255, 0).astype(np.uint8)])


CUP = cylinder(0.04, 0.09) - cylinder(0.036, 0.1).translate((0, 0, 0.006))
MUG = (
    CUP
    + tube(arc([(0.038, 0, 0.075), (0.065, 0, 0.07), (0.065, 0, 0.025), (0.038, 0, 0.02)]), 0.005)
    - cylinder(0.036, 0.1).translate((0, 0, 0.006))
)


@pytest.mark.parametrize("elevation_deg", [15.0, 30.0, 50.0])
def test_flat_ends_tell_the_elevation_and_the_true_height(elevation_deg: float) -> None:
    mask = _photo(_mesh(cylinder(0.03, 0.1)), elevation_deg)[..., 3] > 0
    rows, widths, column = half_widths(mask)
    upper, lower = end_elevations(rows, widths, column)
    assert upper == pytest.approx(elevation_deg, abs=6) and lower == pytest.approx(elevation_deg, abs=6)
    turned = largest_profile(rows, widths, column, elevation_deg)
    assert np.ptp(turned.heights) / (2 * turned.radii.max()) == pytest.approx(0.1 / 0.06, rel=0.05)
    assert np.abs(projected_half_widths(turned, rows) - widths).mean() < 1.5


def test_the_profile_of_a_vase_seen_from_above_is_its_own() -> None:
    heights = np.linspace(0, 0.2, 60)
    radii = 0.04 + 0.015 * np.sin(heights / 0.2 * 2 * np.pi)
    mask = _photo(_mesh(lathe([(0, 0), *zip(radii, heights, strict=True), (0, 0.2)])), 20)[..., 3] > 0
    turned = largest_profile(*half_widths(mask), 20.0)
    at = np.linspace(0.1, 0.9, 9)
    scale = 0.2 / np.ptp(turned.heights)
    found = np.interp(at * 0.2, (turned.heights - turned.heights[0]) * scale, turned.radii * scale)
    assert np.abs(found - np.interp(at * 0.2, heights, radii)).max() < 0.003


@pytest.mark.parametrize("elevation_deg", [12.0, 40.0])
def test_a_mug_seen_from_above_has_hollow_handle_and_height(elevation_deg: float) -> None:
    lifted = lift(_photo(_mesh(MUG), elevation_deg), ShapeHint(stands=True, container=True, round=True))
    assert lifted.notes["primitive"] == "revolution" and lifted.notes["hollow"] and lifted.notes["handles"] == 1
    assert lifted.notes["elevation_deg"] == pytest.approx(elevation_deg, abs=8)
    solid = to_manifold(lifted.surface)
    assert solid.genus() == 1 and len(solid.decompose()) == 1  # the handle's loop is open, the hollow is no hole
    x, y, z = np.ptp(lifted.surface.vertices, axis=0)
    assert y / z == pytest.approx(0.09 / 0.08, rel=0.12) and x / z == pytest.approx(0.11 / 0.08, rel=0.1)
    assert solid.volume() < 0.4 * x * y * z
    assert tip_angle_deg(lifted.surface) > 8
    assert lifted.explained.silhouette_iou > 0.93


def test_what_the_photo_shows_of_the_inside_is_taken_from_it() -> None:
    lifted = lift(_photo(_mesh(CUP), 40), ShapeHint(stands=True, container=True, round=True))
    surface = lifted.surface
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    centers, normals = mesh.triangles_center, mesh.face_normals
    inward = (normals[:, [0, 2]] * centers[:, [0, 2]]).sum(axis=1) < -0.2
    far, near = inward & (centers[:, 2] < -0.2), inward & (centers[:, 2] > 0.2)
    top = centers[:, 1] > 0.75 * centers[:, 1].max()
    assert (
        surface.visible_faces()[far & top].mean() > 0.8 and near.sum() > 100 and not surface.visible_faces()[near].any()
    )


def test_a_ball_is_a_ball_whatever_its_ends_say() -> None:
    lifted = lift(_photo(trimesh.creation.icosphere(5, 0.04), 30), ShapeHint(round=True))
    assert to_manifold(lifted.surface).volume() == pytest.approx(np.pi / 6, rel=0.06)


def test_lying_tools_are_rounded_below_and_rest() -> None:
    club = tube(np.array([[-0.1, 0, 0.02], [0.0, 0.01, 0.02], [0.1, 0, 0.02]]), [0.01, 0.008, 0.02])
    rgba = _photo(_mesh(club), 85)
    lifted = lift(rgba, ShapeHint(stands=False))
    assert lifted.notes["primitive"] == "inflation"
    low = lifted.surface.vertices[:, 1] < 0.2 * np.ptp(lifted.surface.vertices[:, 1])
    width = np.ptp(lifted.surface.vertices[:, 2])
    assert lifted.notes["rests"] == "lying" and tip_angle_deg(lifted.surface) >= 5
    assert np.ptp(lifted.surface.vertices[low, 2]) < 0.95 * width  # the underside is narrower than the whole
