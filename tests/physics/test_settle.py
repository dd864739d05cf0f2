import numpy as np
import pytest
import trimesh

from manitwin.geometry.cavity import find_opening
from manitwin.geometry.hulls.decomposition import convex_decomposition
from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.sapien.settle import ball_stays_inside, settle_on_plane
from real_meshes import VESSELS, cup, load_real_mesh


def _body(mesh: trimesh.Trimesh, mass_kg: float = 0.3) -> RigidBody:
    properties = solid_mass_properties(mesh, mass_kg)
    hulls = (np.asarray(mesh.convex_hull.vertices),)
    return RigidBody(hulls, mass_kg, properties.center_of_mass_m, properties.inertia_kg_m2, 0.6, 0.5)


def _hulls(mesh: trimesh.Trimesh) -> tuple[np.ndarray, ...]:
    opening = find_opening(mesh)
    return convex_decomposition(mesh, max_hulls=32, max_vertices=64, oversplit=1.5, opening=opening).hulls


def test_box_set_down_flat_stays_and_comes_to_rest_at_its_height() -> None:
    box = trimesh.creation.box((0.1, 0.06, 0.04)).apply_translation((0, 0, 0.02))
    (settled,) = settle_on_plane(_body(box), [np.eye(4)], drop_m=0.001, seconds=2.0)
    assert settled.at_rest
    assert settled.moved_m < 0.0005 and settled.turned_rad < np.radians(0.5)
    assert settled.object_to_plane[2, 3] == pytest.approx(0, abs=0.0005)


def test_box_on_an_edge_falls_onto_a_side() -> None:
    box = trimesh.creation.box((0.1, 0.06, 0.04))
    turn = trimesh.transformations.rotation_matrix(np.radians(50), [1, 0, 0])[:3, :3]
    lowest = float((box.vertices @ turn.T)[:, 2].min())
    start = transform(turn, np.array([0, 0, -lowest]))
    (settled,) = settle_on_plane(_body(box), [start], drop_m=0.001, seconds=2.0)
    assert settled.at_rest and settled.turned_rad > np.radians(30)
    assert np.abs(settled.object_to_plane[2, :3]).max() > np.cos(np.radians(1))


def test_copies_in_one_scene_do_not_disturb_each_other() -> None:
    box = trimesh.creation.box((0.1, 0.06, 0.04)).apply_translation((0, 0, 0.02))
    alone = settle_on_plane(_body(box), [np.eye(4)], drop_m=0.001, seconds=1.0)[0]
    together = settle_on_plane(_body(box), [np.eye(4)] * 6, drop_m=0.001, seconds=1.0)
    for settled in together:
        assert settled.object_to_plane == pytest.approx(alone.object_to_plane, abs=1e-4)


def test_small_prism_keeps_its_facets_and_falls_back_onto_the_one_it_was_tilted_off() -> None:
    sides, radius, tilt = 20, 0.0095, np.radians(4)  # every second corner lies 0.46 mm beyond its neighbours' chord
    angle = (np.arange(sides) + 0.5) * 2 * np.pi / sides
    ring = radius * np.stack([np.sin(angle), -np.cos(angle)], 1)
    prism = trimesh.convex.convex_hull(np.vstack([np.insert(ring, 0, x, axis=1) for x in (-0.06, 0.06)]))
    for turned in (0.0, tilt, -tilt):
        turn = trimesh.transformations.rotation_matrix(turned, [1, 0, 0])[:3, :3]
        start = transform(turn, np.array([0, 0, -float((prism.vertices @ turn[2]).min())]))
        (settled,) = settle_on_plane(_body(prism, 0.016), [start], drop_m=0.001, seconds=2.0)
        assert settled.at_rest
        assert settled.object_to_plane[2, 2] > np.cos(np.radians(0.5))
        assert settled.object_to_plane[2, 3] == pytest.approx(radius * np.cos(np.pi / sides), abs=1e-4)


def test_no_poses_settle_nowhere() -> None:
    assert settle_on_plane(_body(trimesh.creation.box((0.1, 0.1, 0.1))), [], drop_m=0.001, seconds=1.0) == []


def test_ball_stays_in_a_cup_and_not_on_its_lid() -> None:
    mesh = cup()
    opening = find_opening(mesh)
    assert opening is not None
    assert ball_stays_inside(_hulls(mesh), opening)
    assert not ball_stays_inside([np.asarray(mesh.convex_hull.vertices)], opening)


def test_ball_falls_through_a_cup_without_a_bottom() -> None:
    opening = find_opening(cup())
    assert opening is not None
    tube = trimesh.creation.annulus(0.037, 0.040, 0.1).apply_translation((0, 0, 0.05))
    assert not ball_stays_inside(_hulls(tube), opening)


@pytest.mark.slow
@pytest.mark.shared_data
def test_ball_stays_in_every_real_vessel(shared_data) -> None:
    for name in VESSELS:
        mesh = load_real_mesh(shared_data, name)
        opening = find_opening(mesh)
        assert opening is not None and ball_stays_inside(_hulls(mesh), opening), name
