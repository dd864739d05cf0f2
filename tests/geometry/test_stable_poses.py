import numpy as np
import pytest
import trimesh

from manitwin.geometry.stable_poses import easiest_tilt, stable_poses


def _face_solid_angle(half_a: float, half_b: float, distance: float) -> float:
    """Return the solid angle of a centred rectangle seen from ``distance`` above its middle."""
    product = half_a * half_b / np.sqrt((half_a**2 + distance**2) * (half_b**2 + distance**2))
    return 4 * float(np.arcsin(product))


def test_box_rests_on_each_face_with_the_solid_angle_of_that_face() -> None:
    sides = np.array([0.10, 0.12, 0.15])
    poses = stable_poses(trimesh.creation.box(sides).vertices, np.zeros(3))
    assert len(poses) == 6
    assert sum(pose.probability for pose in poses) == pytest.approx(1.0)
    for pose in poses:
        down = int(np.abs(pose.rotation[2]).argmax())
        half = np.delete(sides, down) / 2
        assert pose.probability == pytest.approx(_face_solid_angle(*half, sides[down] / 2) / (4 * np.pi))


def test_most_likely_pose_comes_first_and_rests_on_the_plane() -> None:
    points = trimesh.creation.box((0.2, 0.1, 0.02)).vertices
    poses = stable_poses(points, np.zeros(3))
    assert [p.probability for p in poses] == sorted((p.probability for p in poses), reverse=True)
    assert np.abs(poses[0].rotation[2]) == pytest.approx([0, 0, 1], abs=1e-12)
    height = points @ poses[0].rotation[2]
    assert (height < height.min() + 1e-12).sum() == 4


def test_box_topples_off_the_face_that_its_centre_of_mass_overhangs() -> None:
    box = trimesh.creation.box((0.04, 0.04, 0.2))
    sheared = box.vertices + np.outer(box.vertices[:, 2], [0.6, 0, 0])  # leans so far that it cannot stand
    ups = np.array([pose.rotation[2] for pose in stable_poses(sheared, np.zeros(3))])
    assert np.abs(ups[:, 2]).max() < 0.9
    assert sum(pose.probability for pose in stable_poses(sheared, np.zeros(3))) == pytest.approx(1.0)


def test_weighted_bottom_makes_standing_the_likeliest() -> None:
    points = trimesh.creation.icosphere(subdivisions=3, radius=0.05).vertices
    points[:, 2] = np.maximum(points[:, 2], -0.04)
    first = stable_poses(points, np.array([0, 0, -0.03]))[0]
    assert first.rotation[2] == pytest.approx([0, 0, 1], abs=1e-9)
    assert first.probability > 0.95


def test_tilting_a_box_raises_its_centre_by_the_closed_form() -> None:
    width, height, tilt = 0.06, 0.2, np.radians(5)
    points = trimesh.creation.box((width, 0.1, height)).vertices
    rises, tilted = easiest_tilt(points, np.zeros(3), np.eye(3)[None], tilt)
    expected = width / 2 * np.sin(tilt) + height / 2 * np.cos(tilt) - height / 2  # about the edges across the width
    assert rises[0] == pytest.approx(expected)
    assert tilted[0][2] @ [0, 0, 1] == pytest.approx(np.cos(tilt))


def test_tilting_a_fine_sphere_raises_nothing() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    rotations = np.array([pose.rotation for pose in stable_poses(sphere.vertices, np.zeros(3))[:5]])
    assert np.abs(easiest_tilt(sphere.vertices, np.zeros(3), rotations, np.radians(5))[0]).max() < 1e-4
