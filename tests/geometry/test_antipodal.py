"""Contact pairs on shapes whose opposite points are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.antipodal import antipodal_pairs, grasp_frames
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface

FRICTION = 0.5


def pairs_of(mesh: trimesh.Trimesh, max_width_m: float = 1.0, count: int = 2000):
    rng = np.random.default_rng(1)
    points, normals, _ = sample_surface(mesh, count, rng)
    return antipodal_pairs(RayCaster(mesh), points, normals, friction=FRICTION, max_width_m=max_width_m, rng=rng)


def test_pairs_of_a_sphere_are_chords_inside_the_friction_cone() -> None:
    pairs = pairs_of(trimesh.creation.icosphere(subdivisions=5, radius=0.03))
    assert len(pairs) > 1900  # on a sphere the far angle equals the near one: every ray is a pair
    cosine = 1 / np.hypot(1, FRICTION)
    assert pairs.alignment.min() >= cosine - 1e-3
    # chord of a circle: width = 2 r cos(angle to the normal)
    assert pairs.width_m.max() <= 0.06 + 1e-6
    assert pairs.width_m.min() >= 0.06 * cosine - 4e-4  # facets


def test_pairs_of_a_box_are_no_narrower_than_it_and_face_each_other() -> None:
    pairs = pairs_of(trimesh.creation.box([0.02, 0.05, 0.09]))
    closing = (pairs.second_m - pairs.first_m) / pairs.width_m[:, None]
    axis = np.abs(closing).argmax(1)
    assert (pairs.width_m >= np.array([0.02, 0.05, 0.09])[axis] - 1e-6).all()
    assert np.abs(closing).max(1) == pytest.approx(pairs.alignment, abs=1e-6)


def test_a_tube_is_gripped_by_its_wall_and_as_a_whole() -> None:
    tube = trimesh.creation.annulus(r_min=0.027, r_max=0.03, height=0.1, sections=256)
    widths = pairs_of(tube).width_m
    walls, whole = (widths < 0.004).sum(), ((widths > 0.05) & (widths < 0.061)).sum()
    assert walls > 500
    assert whole > 100


def test_pairs_wider_than_allowed_are_not_found() -> None:
    box = trimesh.creation.box([0.02, 0.05, 0.09])
    assert pairs_of(box, max_width_m=0.045).width_m.max() <= 0.045
    assert len(pairs_of(box, max_width_m=0.0199)) == 0


def test_grasp_frames_close_along_the_pair_with_the_fingertips_at_it() -> None:
    pairs = pairs_of(trimesh.creation.box([0.02, 0.05, 0.09]), count=200)
    poses = grasp_frames(pairs, rolls=6, tip_depth_m=0.1, max_depth_offset_m=0.007, rng=np.random.default_rng(2))
    assert len(poses) == 6 * len(pairs)
    rotation = poses[:, :3, :3]
    assert np.linalg.det(rotation) == pytest.approx(1)
    assert rotation @ rotation.transpose(0, 2, 1) == pytest.approx(np.tile(np.eye(3), (len(poses), 1, 1)), abs=1e-9)
    closing = np.repeat((pairs.second_m - pairs.first_m) / pairs.width_m[:, None], 6, axis=0)
    assert (rotation[:, :, 0] * closing).sum(1) == pytest.approx(1)
    tips = poses[:, :3, 3] + 0.1 * rotation[:, :, 2]
    offset = tips - np.repeat((pairs.first_m + pairs.second_m) / 2, 6, axis=0)
    along = (offset * rotation[:, :, 2]).sum(1)
    assert offset == pytest.approx(along[:, None] * rotation[:, :, 2], abs=1e-9)
    assert np.abs(along).max() <= 0.007
    turns = np.degrees(np.arccos(np.clip((rotation[0:6, :, 2] @ rotation[0, :, 2]), -1, 1)))
    assert sorted(turns.round(3)) == pytest.approx([0, 60, 60, 120, 120, 180], abs=1e-2)
