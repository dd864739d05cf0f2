"""Functional frames and resting poses of a twin that was found: where they are in the view."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from located_views import BESIDE_M, BrickView, brick_view
from manitwin.geometry.poses import inverse, rotation_angle_rad, rotation_from_quaternion_wxyz
from manitwin.geometry.symmetry import Symmetries
from manitwin.scenes.locate.proposals import Plane
from manitwin.scenes.locate.report import location_document
from manitwin.scenes.locate.transferred_frames import transfer_frames, transfer_placements
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.point_records import FunctionalPoint

NOISE_M = 0.001


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> BrickView:
    return brick_view(tmp_path_factory.mktemp("frames"), block=True)


def table_of(seen: BrickView) -> Plane:
    """The plane z = 0 of the object frame, in the camera's."""
    normal = seen.object_to_camera[:3, 2]
    return Plane(normal, float(normal @ seen.object_to_camera[:3, 3]))


def _with_points(twin: Twin, *functional: FunctionalPoint) -> Twin:
    other = copy(twin)
    assert twin.record.points is not None
    points = twin.record.points.model_copy(update={"functional": list(functional)})
    other.record = twin.record.model_copy(update={"points": points})
    return other


def test_points_are_where_the_pose_puts_them_and_uncertain_where_poses_differ(seen: BrickView) -> None:
    points = seen.twin.record.points
    assert points is not None and points.functional
    unlike = Symmetries(seen.model.center, np.eye(3)[None], None)  # as if the brick had a knob
    seen = replace(seen, model=replace(seen.model, symmetries=unlike))
    frames = transfer_frames(seen.thing(seen.object_to_camera), seen.twin)
    for frame, point in zip(frames, points.functional, strict=True):
        own = inverse(seen.object_to_camera) @ frame.frame_to_camera
        expected = point.position_m if point.frame is None else point.frame.position_m
        assert np.allclose(own[:3, 3], expected, atol=1e-9) and frame.certain
        if point.frame is None:
            assert np.allclose(own[:3, 2], point.normal, atol=1e-6)
        assert np.isclose(np.linalg.det(own[:3, :3]), 1)
    aside = seen.object_to_camera.copy()
    aside[0, 3] += 0.05
    assert not any(each.certain for each in transfer_frames(seen.thing(seen.object_to_camera, aside), seen.twin))
    assert transfer_frames(seen.thing(), seen.twin) == ()


def test_a_point_that_a_symmetry_moves_is_not_certain(seen: BrickView) -> None:
    """Of a brick that is half turned nothing that depth shows has changed, and its handle is on the other side."""
    points = seen.twin.record.points
    assert points is not None and len(seen.model.symmetry_poses) > 1
    thing = seen.thing(seen.object_to_camera)
    assert not any(each.certain for each in transfer_frames(thing, seen.twin))
    (handle,) = points.functional
    middle = handle.model_copy(update={"position_m": tuple(seen.model.center), "frame": None})
    assert all(each.certain for each in transfer_frames(thing, _with_points(seen.twin, middle)))
    both = [
        handle.model_copy(update={"id": f"f{number}", "position_m": tuple((same @ [*handle.position_m, 1.0])[:3])})
        for number, same in enumerate(seen.model.symmetry_poses)
    ]
    alike = transfer_frames(thing, _with_points(seen.twin, *both))
    assert all(each.certain for each in alike), "one of that label is there in any case"


def test_the_pose_that_it_stands_in_is_its_own_and_all_rest_on_the_table(seen: BrickView) -> None:
    plane = table_of(seen)
    found = transfer_placements(seen.thing(seen.object_to_camera), seen.twin, seen.view, plane, NOISE_M)
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
    found = transfer_placements(seen.thing(moved), seen.twin, seen.view, table_of(seen), NOISE_M)
    assert found and not any(each.free for each in found)


def test_the_document_says_both(seen: BrickView, tmp_path: Path) -> None:
    thing = seen.thing(seen.object_to_camera)
    rests = transfer_placements(thing, seen.twin, seen.view, table_of(seen), NOISE_M)
    said = location_document(thing, seen.twin, None, None, rests)
    assert len(said["placements"]) == len(rests) and said["placements"][0]["position_m"]
    assert {"id", "label", "kind", "position_m", "quaternion_wxyz", "size_m", "certain"} == set(said["functional"][0])
    assert location_document(thing, seen.twin)["placements"] == []
