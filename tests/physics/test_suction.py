"""The seal on shapes whose answer is known: planes, spheres and cylinders of large and small radius, edges, holes, tilts."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import transform
from manitwin.geometry.ray_caster import RayCaster
from manitwin.physics.suction import seal
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.suction import SuctionGripper

CUP = load_gripper("suction")
assert isinstance(CUP, SuctionGripper)
FROM_ABOVE = np.diag([1.0, -1.0, -1.0])


def on_top(mesh: trimesh.Trimesh, x: float = 0.0, tilt_deg: float = 0.0, above_m: float = 0.0) -> np.ndarray:
    """The cup from above at the mesh's highest point, moved along X and turned about its lip's centre."""
    rotation = FROM_ABOVE @ Rotation.from_euler("x", tilt_deg, degrees=True).as_matrix()
    lip = np.array([x, 0, mesh.bounds[1, 2] + above_m])
    return transform(rotation, lip - rotation[:, 2] * CUP.tip_depth_m)[None]


def seals(mesh: trimesh.Trimesh, pose: np.ndarray) -> bool:
    return bool(seal(CUP, pose, RayCaster(mesh)).sealed[0])


def test_seals_on_a_plane_with_the_lip_s_plane_on_it() -> None:
    plate = trimesh.creation.box([0.1, 0.1, 0.02])
    found = seal(CUP, on_top(plate), RayCaster(plate))
    assert found.sealed[0]
    assert found.center_m[0] == pytest.approx([0, 0, 0.01], abs=1e-6)
    assert found.inward[0] == pytest.approx([0, 0, -1], abs=1e-6)


@pytest.mark.parametrize(("radius_m", "expected"), [(0.05, True), (0.032, True), (0.028, False), (0.018, False)])
def test_spheres_seal_down_to_the_lip_s_angle(radius_m: float, expected: bool) -> None:
    # the surface under the lip leans by asin(r / R): 30 degrees at R = 30 mm
    sphere = trimesh.creation.icosphere(5, radius_m)
    assert seals(sphere, on_top(sphere)) is expected


@pytest.mark.parametrize(("radius_m", "expected"), [(0.06, True), (0.033, True), (0.027, False)])
def test_cylinders_seal_down_to_the_lip_s_travel(radius_m: float, expected: bool) -> None:
    # R - sqrt(R^2 - r^2) is 4 mm at R = 30 mm
    cylinder = trimesh.creation.cylinder(radius_m, 0.1, sections=720)
    cylinder.apply_transform(transform(Rotation.from_euler("x", 90, degrees=True).as_matrix()))
    assert seals(cylinder, on_top(cylinder)) is expected


@pytest.mark.parametrize(("x", "expected"), [(0.034, True), (0.037, False), (0.05, False)])
def test_lip_over_an_edge_leaks(x: float, expected: bool) -> None:
    plate = trimesh.creation.box([0.1, 0.1, 0.02])
    assert seals(plate, on_top(plate, x)) is expected


@pytest.mark.parametrize("hole_m", [0.012, 0.004])
def test_hole_under_the_cup_leaks(hole_m: float) -> None:
    ring = trimesh.creation.annulus(hole_m, 0.05, 0.02)
    assert not seals(ring, on_top(ring))
    assert seals(ring, on_top(ring, hole_m + 0.018))  # beside it: sealed


def test_step_under_the_lip_leaks() -> None:
    plate, step = trimesh.creation.box([0.1, 0.1, 0.02]), trimesh.creation.box([0.02, 0.1, 0.005])
    step.apply_translation([0.015, 0, 0.012])
    both = trimesh.util.concatenate([plate, step])
    pose = on_top(plate)
    assert seals(plate, pose)
    assert not seals(both, pose)


def test_low_bump_inside_the_cup_is_spanned_and_a_high_one_is_not() -> None:
    plate = trimesh.creation.box([0.1, 0.1, 0.02])

    def with_bump(height_m: float) -> trimesh.Trimesh:
        bump = trimesh.creation.box([0.008, 0.008, 2 * height_m])
        bump.apply_translation([0, 0, 0.01])
        return trimesh.util.concatenate([plate, bump])

    assert seals(with_bump(0.7 * CUP.ceiling_m), on_top(plate))
    assert not seals(with_bump(1.2 * CUP.ceiling_m), on_top(plate))


@pytest.mark.parametrize(("tilt_deg", "expected"), [(0, True), (10, True), (20, False)])
def test_bellows_turn_as_far_as_they_can(tilt_deg: float, expected: bool) -> None:
    plate = trimesh.creation.box([0.2, 0.2, 0.02])
    pose = on_top(plate, tilt_deg=tilt_deg)
    assert seals(plate, pose) is expected
    if expected:
        assert seal(CUP, pose, RayCaster(plate)).inward[0] == pytest.approx([0, 0, -1], abs=1e-4)


@pytest.mark.parametrize(("above", "expected"), [(-0.9, True), (0.9, True), (1.1, False), (-1.1, False)])
def test_cup_is_pressed_on_as_far_as_it_reaches(above: float, expected: bool) -> None:
    plate = trimesh.creation.box([0.1, 0.1, 0.02])
    pose = on_top(plate, above_m=above * CUP.reach_m)
    found = seal(CUP, pose, RayCaster(plate))
    assert bool(found.sealed[0]) is expected
    if expected:
        assert found.advance_m[0] == pytest.approx(above * CUP.reach_m, abs=1e-6)


def test_inside_of_a_wall_does_not_count_as_its_surface() -> None:
    # from within matter the first hit is the far face, seen from behind
    plate = trimesh.creation.box([0.1, 0.1, 0.06])
    pose = transform(FROM_ABOVE, np.array([0, 0, -0.03 + CUP.tip_depth_m]))[None]
    assert not seals(plate, pose)
