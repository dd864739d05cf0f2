"""Frames of bodies whose features are known in closed form."""

import numpy as np
import pytest
import trimesh

from manitwin.geometry.frames.feature import FeatureFrame, FramedMesh, NoFrame
from manitwin.geometry.frames.feature_deviation import ON_FEATURE_M, feature_deviation_m
from manitwin.geometry.frames.find import find_frame
from manitwin.geometry.frames.label_keywords import frame_kinds_for_label, is_compatible_kind
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.geometry.sampling import farthest_point_sampling, sample_surface
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.object_sampling import make_object

TURN = rotation_from_quaternion_wxyz(np.array([0.9, 0.1, -0.3, 0.3]) / np.linalg.norm([0.9, 0.1, -0.3, 0.3]))


def framed(mesh: trimesh.Trimesh) -> FramedMesh:
    return FramedMesh(mesh, mesh.center_mass, 0)


def turned(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    pose = np.eye(4)
    pose[:3, :3] = TURN
    return mesh.copy().apply_transform(pose)


def found(mesh: trimesh.Trimesh, point: object, normal: object, label: str) -> FeatureFrame:
    surface = framed(mesh)
    frame = find_frame(surface, np.array(point, float), np.array(normal, float), label)
    assert isinstance(frame, FeatureFrame), frame
    assert np.allclose(frame.rotation.T @ frame.rotation, np.eye(3), atol=1e-9)
    assert np.linalg.det(frame.rotation) == pytest.approx(1)
    off = feature_deviation_m(frame.kind, frame.position_m, frame.rotation, frame.size_m, surface.samples[0])
    assert off < ON_FEATURE_M
    return frame


def cup(handle: bool = True) -> trimesh.Trimesh:
    outer = trimesh.creation.cylinder(0.04, 0.09, sections=96)
    inner = trimesh.creation.cylinder(0.037, 0.09, sections=96).apply_translation([0, 0, 0.004])
    if handle:
        loop = trimesh.creation.torus(0.024, 0.006, major_sections=48, minor_sections=24)
        loop.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0])).apply_translation(
            [0.05, 0, 0]
        )
        outer = outer.union(loop)
    return outer.difference(inner).apply_translation([0, 0, 0.045])


def test_face_of_a_turned_box_is_its_middle() -> None:
    box = turned(trimesh.creation.box((0.1, 0.06, 0.04)))
    frame = found(box, TURN @ [0.03, 0.02, 0.02], TURN @ [0, 0, 1], "cover")
    assert frame.kind == "face" and not frame.roll_free
    assert np.allclose(frame.position_m, TURN @ [0, 0, 0.02], atol=1e-6)
    assert np.allclose(frame.z, TURN @ [0, 0, 1], atol=1e-6)
    assert abs(frame.x @ (TURN @ [1, 0, 0])) == pytest.approx(1)
    assert frame.size_m == pytest.approx(np.sqrt(0.1 * 0.06 / np.pi))


def test_opening_of_a_cup_pours_away_from_its_handle() -> None:
    frame = found(cup(), [-0.0385, 0, 0.09], [0, 0, 1], "opening")
    assert frame.kind == "opening" and not frame.roll_free
    assert np.allclose(frame.position_m, [0, 0, 0.09], atol=0.002)
    assert frame.z @ [0, 0, 1] > np.cos(np.radians(1)) and frame.x @ [-1, 0, 0] > np.cos(np.radians(5))
    assert found(cup(handle=False), [-0.0385, 0, 0.09], [0, 0, 1], "rim").roll_free


@pytest.mark.parametrize("label", ["handle hole", "handle"])
def test_loop_of_a_handle_is_a_hole_and_the_mouth_beside_it_is_not(label: str) -> None:
    frame = found(cup(), [0.08, 0, 0.045], [1, 0, 0], label)
    assert frame.kind == "hole" and abs(frame.z @ [0, 1, 0]) > np.cos(np.radians(5))
    assert abs(frame.position_m[1]) < 0.002


@pytest.mark.parametrize("label", ["hole", "bore"])
def test_bore_of_a_turned_ring(label: str) -> None:
    ring = turned(trimesh.creation.annulus(0.01, 0.02, 0.03, sections=64))
    frame = found(ring, TURN @ [0.01, 0, 0.004], TURN @ [-1, 0, 0], label)
    assert abs(frame.z @ (TURN @ [0, 0, 1])) > np.cos(np.radians(1))
    assert np.allclose(frame.position_m, 0, atol=0.001) and frame.size_m == pytest.approx(0.01, rel=0.02)


def test_axis_and_tip_of_a_rod() -> None:
    rod = turned(trimesh.creation.cylinder(0.008, 0.2, sections=48))
    axis = found(rod, TURN @ [0.008, 0, 0.03], TURN @ [1, 0, 0], "shaft")
    assert abs(axis.z @ (TURN @ [0, 0, 1])) > np.cos(np.radians(1)) and axis.size_m == pytest.approx(0.2, abs=0.012)
    tip = found(rod, TURN @ [0.008, 0, 0.095], TURN @ [1, 0, 0], "tip")
    assert np.allclose(tip.position_m, TURN @ [0, 0, 0.1], atol=0.002) and tip.z @ (TURN @ [0, 0, 1]) > 0.999


def legged(feet: float) -> trimesh.Trimesh:
    """An animal of 13 cm whose four legs end in discs of a radius (m)."""
    places = [(x, y) for x in (-0.05, 0.05) for y in (-0.02, 0.02)]
    legs = [trimesh.creation.cylinder(0.006, 0.05).apply_translation([x, y, 0.025]) for x, y in places]
    discs = [trimesh.creation.cylinder(feet, 0.006).apply_translation([x, y, 0.003]) for x, y in places]
    trunk = trimesh.creation.box((0.13, 0.06, 0.04)).apply_translation([0, 0, 0.065])
    return trimesh.boolean.union([trunk, *legs, *discs])


def test_feet_look_down_and_the_side_of_a_leg_is_no_foot() -> None:
    under = found(legged(0.012), [0.055, 0.02, 0], [0, 0, -1], "feet")
    assert under.kind in ("tip", "face") and under.z @ [0, 0, -1] > 0.999 and abs(under.position_m[2]) < 1e-3
    beside = found(legged(0.007), [0.056, 0.02, 0.03], [1, 0, 0], "leg")
    assert beside.kind != "face"


def test_edge_of_a_wedge_is_its_sharp_side() -> None:
    wedge = trimesh.convex.convex_hull(
        [[x, y, z] for x in (-0.08, 0.08) for y, z in ((-0.02, 0), (0.02, 0.0015), (0.02, -0.0015))]
    )
    frame = found(wedge, [0.01, -0.01, 0.0004], [0, 0, 1], "blade")
    assert frame.kind == "edge" and abs(frame.x @ [1, 0, 0]) > 0.999
    assert frame.z @ [0, -1, 0] > 0.99 and frame.size_m == pytest.approx(0.16, abs=0.01)
    assert abs(frame.position_m[1] + 0.02) < 0.002


@pytest.mark.parametrize("label", ["opening", "hole", "blade", "tip", "button"])
def test_ball_has_no_frame_but_a_reason(label: str) -> None:
    ball = trimesh.creation.icosphere(4, 0.04)
    for point in ([0, 0, 0.04], [0.04, 0, 0]):
        frame = find_frame(framed(ball), np.array(point), np.array(point) / 0.04, label)
        assert isinstance(frame, NoFrame) and frame.reason if label != "button" else frame.kind == "surface"


def test_frame_beside_its_feature_is_told() -> None:
    surface = framed(cup())
    points, turn = surface.samples[0], np.eye(3)
    assert feature_deviation_m("opening", np.array([0, 0, 0.09]), turn, 0.037, points) < ON_FEATURE_M
    assert feature_deviation_m("opening", np.array([0, 0, 0.1]), turn, 0.037, points) > ON_FEATURE_M
    assert feature_deviation_m("opening", np.array([0.1, 0, 0.09]), turn, 0.037, points) == np.inf
    assert feature_deviation_m("tip", np.array([0, 0, 0.05]), turn, 0.01, points) > 0.03


def test_words_choose_the_kind() -> None:
    assert frame_kinds_for_label("Mouth")[0] == "opening" and frame_kinds_for_label("cutting edge") == ("edge",)
    assert frame_kinds_for_label("pouring spout") == ("tip",) and frame_kinds_for_label("base")[0] == "face"
    assert (
        frame_kinds_for_label("front feet")[0] == frame_kinds_for_label("toe")[0] == "tip"
        and frame_kinds_for_label("foot")[0] == "face"
    )
    assert (
        is_compatible_kind("handle", "hole")
        and is_compatible_kind("thing", "edge")
        and not is_compatible_kind("blade", "opening")
    )


def test_bristles_that_stand_out_of_the_side_near_an_end_have_no_frame() -> None:
    handle = trimesh.creation.box((0.16, 0.012, 0.006)).apply_translation([-0.08, 0, 0])
    tuft = trimesh.creation.box((0.02, 0.012, 0.018)).apply_translation([-0.012, 0, 0.011])
    brush = framed(handle.union(tuft))
    nothing = find_frame(brush, np.array([-0.004, 0, 0.02]), np.array([0, 0, 1.0]), "bristles")
    assert isinstance(nothing, NoFrame) and "different ways" in nothing.reason


def test_tip_of_what_ends_in_two_directions_is_not_clear() -> None:
    """A hammer's claw bends away from the handle: beside its root the tool's own end is as near as the claw's."""
    templates = load_templates()
    made = make_object(templates["hammer"], read_text("hammer", templates), np.random.default_rng(0))
    hammer = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    points, normals, faces = sample_surface(hammer, 8000, np.random.default_rng(0))
    claw = next(known for known in made.points if known.label == "claw")
    chosen = farthest_point_sampling(points, 42, 0)
    on_claw = chosen[made.mesh.part[faces[chosen]] == made.mesh.names.index(claw.part)]
    nearest = on_claw[np.linalg.norm(points[on_claw] - claw.position_m, axis=1).argmin()]
    nothing = find_frame(framed(hammer), points[nearest], normals[nearest], "claw")
    assert isinstance(nothing, NoFrame) and "several directions" in nothing.reason


def test_place_on_a_thin_rod_has_a_frame_as_small_as_what_is_flat_there() -> None:
    rod = trimesh.creation.cylinder(0.003, 0.06, sections=48).apply_translation([0, 0, 0.03])
    thing = trimesh.creation.box((0.12, 0.12, 0.02)).apply_translation([0, 0, -0.01]).union(rod)
    frame = found(thing, [0.003, 0, 0.04], [1, 0, 0], "joint")
    assert frame.kind == "surface" and frame.z @ [1, 0, 0] > np.cos(np.radians(10))
    assert frame.size_m < 0.003


def test_place_on_a_thorn_has_no_frame() -> None:
    thorn = trimesh.creation.cone(0.001, 0.01, sections=24)
    thing = trimesh.creation.box((0.12, 0.12, 0.02)).apply_translation([0, 0, -0.009]).union(thorn)
    surface = framed(thing)
    tip = find_frame(surface, np.array([0.0, 0.0, 0.0099]), np.array([0.8, 0.0, 0.6]), "joint")
    assert isinstance(tip, NoFrame)


def test_distance_of_a_frame_is_exact_where_samples_are_far_apart() -> None:
    cube = trimesh.creation.box((0.4, 0.4, 0.4))
    center, corners = np.array([0, 0, 0.2]), np.asarray(cube.vertices)
    assert feature_deviation_m("face", center, np.eye(3), 0.2, corners) > 0.2
    assert feature_deviation_m("face", center, np.eye(3), 0.2, corners, cube) == pytest.approx(0, abs=1e-9)
    assert feature_deviation_m("face", np.array([0, 0, 0.23]), np.eye(3), 0.2, corners, cube) == pytest.approx(0.03)


def test_place_on_an_edge_has_the_frame_of_the_side_that_it_looks_to() -> None:
    plate = trimesh.creation.box((0.2, 0.03, 0.004))
    edge = found(plate, [0.03, 0.015, 0.002], [0, 0.6, 0.8], "head")
    assert edge.kind == "surface" and edge.z @ [0, 0, 1] > 0.99
    assert abs(edge.position_m[2] - 0.002) < 1e-4 and np.linalg.norm(edge.position_m - [0.03, 0.015, 0.002]) < 0.005
    corner = find_frame(framed(plate), np.array([0.1, 0.015, 0.002]), np.full(3, 3**-0.5), "head")
    assert isinstance(corner, NoFrame)  # three sides, and it looks to none of them
