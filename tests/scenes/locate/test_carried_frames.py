"""Functional frames and resting poses of a twin that was found: where they are in the view."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from located_views import BESIDE_M, BrickView, brick_view
from manitwin.geometry.poses import inverse, rotation_angle_rad, rotation_from_quaternion_wxyz
from manitwin.scenes.locate.carried_frames import carry_frames, carry_placements
from manitwin.scenes.locate.proposals import Plane
from manitwin.scenes.locate.report import location_document

NOISE_M = 0.001


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> BrickView:
    return brick_view(tmp_path_factory.mktemp("frames"), block=True)


def table_of(seen: BrickView) -> Plane:
    """The plane z = 0 of the object frame, in the camera's."""
    normal = seen.object_to_camera[:3, 2]
    return Plane(normal, float(normal @ seen.object_to_camera[:3, 3]))


def test_points_are_where_the_pose_puts_them_and_uncertain_where_poses_differ(seen: BrickView) -> None:
    points = seen.twin.record.points
    assert points is not None and points.functional
    frames = carry_frames(seen.thing(seen.object_to_camera), seen.twin)
    for frame, point in zip(frames, points.functional, strict=True):
        own = inverse(seen.object_to_camera) @ frame.frame_to_camera
        expected = point.position_m if point.frame is None else point.frame.position_m
        assert np.allclose(own[:3, 3], expected, atol=1e-9) and frame.certain
        if point.frame is None:
            assert np.allclose(own[:3, 2], point.normal, atol=1e-6)
        assert np.isclose(np.linalg.det(own[:3, :3]), 1)
    aside = seen.object_to_camera.copy()
    aside[0, 3] += 0.05
    assert not any(each.certain for each in carry_frames(seen.thing(seen.object_to_camera, aside), seen.twin))
    assert carry_frames(seen.thing(), seen.twin) == ()


def test_the_pose_that_it_stands_in_is_its_own_and_all_rest_on_the_table(seen: BrickView) -> None:
    plane = table_of(seen)
    found = carry_placements(seen.thing(seen.object_to_camera), seen.twin, seen.view, plane, NOISE_M)
    settled = [number for number, each in enumerate(seen.twin.record.placements or []) if each.settled]
    assert [each.number for each in found] == settled
    for each in found:
        points = seen.model.points @ each.object_to_camera[:3, :3].T + each.object_to_camera[:3, 3]
        assert abs(plane.height_m(points).min()) < 1e-6
        own = seen.twin.record.placements[each.number]  # type: ignore[index]
        up = rotation_from_quaternion_wxyz(np.array(own.quaternion_wxyz))[2]
        assert np.allclose(each.object_to_camera[:3, :3] @ up, plane.normal, atol=1e-9)
    (stands,) = [each for each in found if each.stands]
    turned = stands.object_to_camera[:3, :3].T @ seen.object_to_camera[:3, :3]
    assert rotation_angle_rad(turned) < 1e-6, "the nearest turn is the one that it has"
    assert np.allclose(stands.object_to_camera[:3, 3], seen.object_to_camera[:3, 3], atol=2e-3)
    assert stands.free


def test_a_resting_pose_that_meets_what_is_seen_beside_is_not_free(seen: BrickView) -> None:
    moved = seen.object_to_camera.copy()
    moved[:3, 3] += seen.object_to_camera[:3, :3] @ (BESIDE_M + np.array([0.03, 0.03, 0.0]))  # into the block
    found = carry_placements(seen.thing(moved), seen.twin, seen.view, table_of(seen), NOISE_M)
    assert found and not any(each.free for each in found)


def test_the_document_says_both(seen: BrickView, tmp_path: Path) -> None:
    thing = seen.thing(seen.object_to_camera)
    rests = carry_placements(thing, seen.twin, seen.view, table_of(seen), NOISE_M)
    said = location_document(thing, seen.twin, None, None, rests)
    assert len(said["placements"]) == len(rests) and said["placements"][0]["position_m"]
    assert {"id", "label", "kind", "position_m", "quaternion_wxyz", "size_m", "certain"} == set(said["functional"][0])
    assert location_document(thing, seen.twin)["placements"] == []
