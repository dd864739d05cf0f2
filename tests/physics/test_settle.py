import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.geometry.cavity import find_opening
from manitwin.geometry.hulls.decomposition import convex_decomposition
from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject, RigidBody, StaticBox
from manitwin.physics.sapien.settle import ball_stays_inside, settle_on_plane, settle_scene
from real_meshes import VESSELS, cup, load_real_mesh
from scene_twins import bowl, can, slab, standing_at

TABLE = StaticBox("table", np.array([0.5, 0.5, 0.02]), transform(translation=np.array([0, 0, -0.02])))
BOX = slab("box", 0.12, 0.08, 0.06, 0.3).body()


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
    assert settled.moved_m < 0.0005
    assert settled.object_to_plane[2, 2] > np.cos(np.radians(0.5))
    assert settled.object_to_plane[2, 3] == pytest.approx(0, abs=0.0005)


def test_box_on_an_edge_falls_onto_a_side() -> None:
    box = trimesh.creation.box((0.1, 0.06, 0.04))
    turn = trimesh.transformations.rotation_matrix(np.radians(50), [1, 0, 0])[:3, :3]
    lowest = float((box.vertices @ turn.T)[:, 2].min())
    start = transform(turn, np.array([0, 0, -lowest]))
    (settled,) = settle_on_plane(_body(box), [start], drop_m=0.001, seconds=2.0)
    assert settled.at_rest
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


def test_what_stands_stays_and_says_what_it_stands_on() -> None:
    stack = [
        PlacedObject("low", "t", BOX, standing_at(0, 0)),
        PlacedObject("high", "t", BOX, standing_at(0.01, 0, 0.06)),
    ]
    other = PlacedObject("other", "c", can().body(), standing_at(0.2, 0.2))
    settled = settle_scene([*stack, other], [TABLE], seconds=2.0)
    assert settled.at_rest.all() and not settled.lost.any()
    assert set(settled.touching) == {("table", "low"), ("low", "high"), ("table", "other")}
    assert settled.neighbours("low") == {"table", "high"}
    starts = np.array([each.object_to_world for each in [*stack, other]])
    np.testing.assert_allclose(settled.object_to_world, starts, atol=1e-3)
    assert settled.steps < 120


def test_what_is_heavy_settles_on_what_is_light_and_not_in_it() -> None:
    light, heavy = (trimesh.creation.box([0.08, 0.08, 0.04]), 0.005), (trimesh.creation.box([0.06, 0.06, 0.06]), 2.0)
    objects = [
        PlacedObject(name, "t", _body(mesh, kg), transform(translation=np.array([0, 0, z])))
        for name, (mesh, kg), z in (("light", light, 0.02), ("heavy", heavy, 0.0705))
    ]
    settled = settle_scene(objects, [TABLE], seconds=2.0)
    assert settled.object_to_world[1, 2, 3] - settled.object_to_world[0, 2, 3] == pytest.approx(0.05, abs=3e-4)


def test_a_box_on_its_edge_tips_to_the_nearest_side() -> None:
    tilted = transform(Rotation.from_euler("x", 30, degrees=True).as_matrix(), np.array([0, 0, 0.021]))
    settled = settle_scene([PlacedObject("box", "t", BOX, tilted)], [TABLE], seconds=2.0)
    assert settled.at_rest.all()
    np.testing.assert_allclose(settled.object_to_world[0, 2, :3], [0, 0, 1], atol=1e-2)


def test_what_falls_off_is_lost_and_not_waited_for() -> None:
    objects = [PlacedObject("box", "t", BOX, standing_at(0, 0)), PlacedObject("off", "t", BOX, standing_at(0.9, 0))]
    settled = settle_scene(objects, [TABLE], seconds=2.0, give_up_m=[0.03, 0.03])
    assert settled.lost.tolist() == [False, True]
    assert settled.steps <= 24  # 3 cm of free fall take 19 steps


def test_the_same_scene_ends_the_same_whatever_was_settled_before() -> None:
    objects = [PlacedObject(f"o{i}", "t", BOX, standing_at(0.2 * i, 0.01 * i, 0.002 * i)) for i in range(3)]
    first = settle_scene(objects, [TABLE], seconds=2.0)
    settle_scene([PlacedObject("bowl", "b", bowl().body(), standing_at(0, 0, 0.01)), objects[2]], [TABLE], seconds=1.0)
    again = settle_scene(objects, [TABLE], seconds=2.0)
    np.testing.assert_array_equal(first.object_to_world, again.object_to_world)
    assert first.touching == again.touching


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
