from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.geometry.canonical_frame import UpChoice, choose_up, object_frame
from manitwin.geometry.poses import transform_points


def _stood(mesh: trimesh.Trimesh, choice: UpChoice) -> trimesh.Trimesh:
    vertices = transform_points(object_frame(mesh.vertices, choice.rotation), mesh.vertices)
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


def _bottle() -> trimesh.Trimesh:
    """A turned bottle along z, 60 mm wide, 200 mm tall."""
    profile = np.array([(0, 0), (30, 0), (30, 130), (12, 160), (12, 200), (0, 200)]) / 1000.0
    return trimesh.creation.revolve(profile, sections=48)


def _cup() -> trimesh.Trimesh:
    """A cup along z, 80 mm wide, 100 mm tall, wall 3 mm."""
    profile = np.array([(0, 0), (40, 0), (40, 100), (37, 100), (37, 3), (0, 3)]) / 1000.0
    return trimesh.creation.revolve(profile, sections=64)


def _turned(mesh: trimesh.Trimesh, euler_deg: tuple[float, float, float]) -> trimesh.Trimesh:
    rotation = Rotation.from_euler("xyz", euler_deg, degrees=True).as_matrix()
    return trimesh.Trimesh(mesh.vertices @ rotation.T, mesh.faces, process=False)


def test_object_frame_has_its_origin_at_the_bottom_centre() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(loc=(5, -7, 3), size=(200, 3))
    placed = transform_points(object_frame(points, Rotation.random(rng=1).as_matrix()), points)
    np.testing.assert_allclose(placed.min(0)[:2], -placed.max(0)[:2], atol=1e-12)
    assert placed[:, 2].min() == pytest.approx(0, abs=1e-12)


def test_cup_that_lies_in_its_file_is_stood_up_with_its_opening_up() -> None:
    for euler in ((90, 0, 0), (-90, 0, 0), (180, 0, 0), (0, 90, 20)):
        cup = _turned(_cup(), euler)
        stood = _stood(cup, choose_up(cup, file_up="z", stands=True))
        assert stood.extents[2] == pytest.approx(0.1, abs=1e-6)
        assert stood.center_mass[2] < 0.05, "the bottom is the heavy end"


def test_bottle_tilted_by_a_generator_is_set_straight() -> None:
    bottle = _turned(_bottle(), (15, 0, 0))
    stood = _stood(bottle, choose_up(bottle, file_up="z", stands=True))
    np.testing.assert_allclose(stood.extents, [0.06, 0.06, 0.2], atol=2e-4)


def test_bottle_in_a_y_up_file_without_a_rule_stands_up() -> None:
    bottle = _turned(_bottle(), (-90, 0, 0))
    assert bottle.extents[1] == pytest.approx(0.2)
    choice = choose_up(bottle, stands=True)
    assert choice.up == "y"
    stood = _stood(bottle, choice)
    assert stood.extents[2] == pytest.approx(0.2, abs=1e-6) and stood.center_mass[2] < 0.1


def test_thing_that_lies_is_laid_down() -> None:
    pen = trimesh.creation.cylinder(radius=0.005, height=0.14, sections=24)
    stood = _stood(pen, choose_up(pen, file_up="z", stands=False))
    assert stood.extents[2] < 0.011


@pytest.mark.parametrize("turn_deg", [0, 17, 40, 110])
def test_what_is_laid_down_lies_along_an_axis_of_its_frame(turn_deg: int) -> None:
    """A flashlight stood on its lens in its file: it lay at any angle, 13.9 cm long in a box of 9.8 x 12.9 cm."""
    profile = np.array([(0, 0), (17, 0), (17, 30), (12, 45), (12, 139), (0, 139)]) / 1000.0
    light = _turned(trimesh.creation.revolve(profile, sections=48), (0, 0, turn_deg))
    stood = _stood(light, choose_up(light, stands=False))
    assert sorted(stood.extents)[2] == pytest.approx(0.139, abs=2e-3)  # it leans on its head
    assert sorted(stood.extents)[1] == pytest.approx(0.034, abs=2e-3)


def test_unnamed_thing_keeps_the_formats_axis_where_it_rests_so() -> None:
    block = trimesh.creation.box(extents=(0.05, 0.08, 0.12))
    choice = choose_up(block, file_up="z")
    np.testing.assert_allclose(choice.rotation, np.eye(3), atol=1e-9)
    assert choice.turned_deg == pytest.approx(0, abs=1e-5)


def test_user_decides_even_against_balance() -> None:
    cone = trimesh.creation.cone(radius=0.02, height=0.1, sections=32)
    upside_down = _turned(cone, (180, 0, 0))
    choice = choose_up(upside_down, user="z")
    np.testing.assert_allclose(choice.rotation, np.eye(3), atol=1e-12)
    assert choice.probability == 0.0
    assert "as the user says" in choice.reason


@pytest.mark.parametrize("turned_deg", [0, 30])
def test_the_reason_names_who_said_which_axis_is_up(turned_deg: int) -> None:
    block = _turned(trimesh.creation.box(extents=(0.1, 0.06, 0.04)), (turned_deg, 0, 0))
    assert "z is up as the generator says" in choose_up(block, user="z", said_by="the generator").reason


def test_pose_is_snapped_onto_its_facet_and_keeps_its_yaw() -> None:
    block = _turned(trimesh.creation.box(extents=(0.1, 0.06, 0.04)), (0, 0, 30))
    tilted = _turned(block, (3, -2, 0))
    stood = _stood(tilted, choose_up(tilted, user="z"))
    low = stood.vertices[:, 2] < 1e-9
    assert low.sum() == 4
    edge = stood.vertices[np.argmax(stood.vertices[:, 0])][:2] - stood.vertices[np.argmin(stood.vertices[:, 1])][:2]
    heading = np.degrees(np.arctan2(edge[1], edge[0])) % 90
    assert min(abs(heading - 30), abs(heading - 60)) < 0.2


def test_y_up_maps_to_z_up_without_spinning() -> None:
    block = trimesh.creation.box(extents=(0.05, 0.12, 0.08))
    choice = choose_up(block, file_up="y")
    np.testing.assert_allclose(choice.rotation, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-9)


@pytest.mark.parametrize("turn_deg", [(90, 0, 0), (0, 90, 0), (0, -90, 0)])
def test_bottle_that_lies_as_its_format_says_is_stood_on_its_base(turn_deg: tuple[float, float, float]) -> None:
    lying = _turned(_bottle(), turn_deg)
    choice = choose_up(lying, file_up="z", stands=True)
    stood = _stood(lying, choice)
    assert stood.extents == pytest.approx(_bottle().extents, abs=1e-3)
    assert stood.center_mass[2] - stood.bounds[0, 2] < stood.extents[2] / 2  # base down
    assert "stands" in choice.reason
    assert choose_up(lying, file_up="z", stands=None).turned_deg < 5  # of a thing that may lie the format decides


@pytest.mark.parametrize(("turn_deg", "upright"), [((-90, 0, 0), True), ((90, 0, 0), False), ((0, 90, 0), True)])
def test_a_short_can_that_lies_in_its_file_stands_on_an_end(
    turn_deg: tuple[float, float, float], upright: bool
) -> None:
    """It is 66 mm wide and 80 mm high, and its tab sticks out; both ends are flat: the axis of the file points to the top."""
    can = trimesh.creation.cylinder(0.033, 0.08, sections=64)
    tab = trimesh.creation.box((0.012, 0.012, 0.003), trimesh.transformations.translation_matrix((0.0315, 0, 0.038)))
    lying = _turned(trimesh.boolean.union([can, tab], engine="manifold"), turn_deg)
    choice = choose_up(lying, stands=True, opens_up=True)
    stood = _stood(lying, choice)
    assert stood.extents[2] == pytest.approx(0.08, abs=1e-3), choice.reason
    assert bool(stood.vertices[stood.vertices[:, 0].argmax(), 2] > 0.04) or not upright
    assert choose_up(lying, stands=True, opens_up=False).turned_deg < 30  # a drum, a roll and a clock may stand so


def test_a_flask_that_stands_on_edge_is_laid_on_no_face() -> None:
    disc = _turned(trimesh.creation.cylinder(0.05, 0.03, sections=64), (90, 0, 0))
    foot = trimesh.creation.box((0.05, 0.03, 0.01), trimesh.transformations.translation_matrix((0, 0, -0.05)))
    flask = trimesh.boolean.union([disc, foot], engine="manifold")
    assert choose_up(flask, stands=True, opens_up=True).turned_deg < 1


def test_what_lies_and_is_not_round_stays_as_its_format_says() -> None:
    body = trimesh.creation.cylinder(0.12, 0.05)
    handle = trimesh.creation.box([0.2, 0.03, 0.02], transform=trimesh.transformations.translation_matrix([0.21, 0, 0]))
    pan = trimesh.boolean.union([body, handle], engine="manifold")
    assert choose_up(pan, file_up="z", stands=True).turned_deg < 10


def _hollow_brick() -> trimesh.Trimesh:
    """A toy brick of 64 x 32 x 19 mm, open below."""
    outside = trimesh.creation.box(extents=(0.064, 0.032, 0.019))
    inside = trimesh.creation.box(extents=(0.061, 0.029, 0.019))
    return trimesh.boolean.difference([outside, inside.apply_translation((0, 0, -0.0015))], engine="manifold")


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ({"opens_up": False, "stands": True}, True),
        ({"file_up": "z"}, True),  # nobody has named it, but its format says which side is up
        ({}, False),
        ({"file_up": "z", "opens_up": True}, False),  # a cup stands on its rim in no file that means it
    ],
)
def test_a_thing_that_is_hollow_from_below_is_not_turned_over(given: dict, kept: bool) -> None:
    choice = choose_up(_hollow_brick(), **given)
    assert choice.turned_deg == pytest.approx(0.0 if kept else 180.0, abs=0.1), choice.reason


def test_a_brick_of_a_y_up_file_without_a_rule_keeps_its_opening_below() -> None:
    brick = _turned(_hollow_brick(), (-90, 0, 0))
    stood = _stood(brick, choose_up(brick, stands=True, opens_up=False))
    assert stood.center_mass[2] > stood.extents[2] / 2, "its top plate is the heavy end"


def test_a_thing_that_stands_and_is_upside_down_in_its_file_is_turned_over() -> None:
    cone = _turned(trimesh.creation.cone(radius=0.02, height=0.12, sections=32), (180, 0, 0))
    standing, unknown = choose_up(cone, stands=True), choose_up(cone)
    assert standing.turned_deg == pytest.approx(180.0, abs=0.1) and "upside down" in standing.reason
    assert unknown.turned_deg < 150


def test_a_bottle_that_lies_in_the_world_of_its_file_is_stood_up_and_one_that_a_person_laid_down_is_not() -> None:
    lying = _turned(_bottle(), (90, 0, 0))
    for by_convention, vessel, height in ((True, True, 0.2), (False, True, 0.06), (True, False, 0.06)):
        choice = choose_up(lying, user="z", stands=True, opens_up=vessel, by_convention=by_convention)
        assert _stood(lying, choice).extents[2] == pytest.approx(height, abs=1e-3), choice.reason


def test_a_container_with_its_long_axis_level_is_put_on_no_end_in_the_world_of_its_file() -> None:
    caddy = trimesh.creation.box((0.4, 0.16, 0.16))  # of square section: round about its long axis, as moments have it
    for level, height in ((True, 0.16), (False, 0.4)):
        choice = choose_up(caddy, user="z", stands=True, opens_up=True, level=level, by_convention=True)
        assert _stood(caddy, choice).extents[2] == pytest.approx(height, abs=1e-3), choice.reason


def test_a_long_container_that_opens_along_the_axis_of_its_file_stays_so_in_its_world() -> None:
    outside = trimesh.creation.box((0.18, 0.09, 0.09))
    inside = trimesh.creation.box((0.17, 0.08, 0.09)).apply_translation((0, 0, 0.005))
    trough = trimesh.boolean.difference([outside, inside], engine="manifold")
    for euler_deg, height in (
        ((0, 0, 0), 0.09),
        ((180, 0, 0), 0.18),
    ):  # with its opening down, an end is as good as any
        turned = _turned(trough, euler_deg)
        choice = choose_up(turned, user="z", stands=True, opens_up=True, by_convention=True)
        assert _stood(turned, choice).extents[2] == pytest.approx(height, abs=1e-3), choice.reason


def test_a_thing_that_lies_and_stands_on_its_end_in_the_world_of_its_file_is_laid_down() -> None:
    rod = trimesh.creation.capsule(0.12, 0.008)
    for by_convention, stands, height in ((True, False, 0.016), (False, False, 0.136), (True, None, 0.136)):
        choice = choose_up(rod, user="z", stands=stands, by_convention=by_convention)
        assert _stood(rod, choice).extents[2] == pytest.approx(height, abs=1e-3), choice.reason
    spoon = _turned(trimesh.creation.box((0.15, 0.03, 0.01)), (20, 0, 0))  # one that is only tilted stays as it is told
    assert choose_up(spoon, user="z", stands=False, by_convention=True).reason.endswith("although it does not rest so")


def _van() -> trimesh.Trimesh:
    """A van of 120 by 64 by 64 mm along x, standing on four wheels with z up."""
    body = trimesh.creation.box((0.12, 0.06, 0.05), trimesh.transformations.translation_matrix((0, 0, 0.039)))
    wheels = [
        trimesh.creation.cylinder(
            0.014,
            0.008,
            transform=trimesh.transformations.translation_matrix((x, y, 0.014))
            @ trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)),
        )
        for x in (-0.04, 0.04)
        for y in (-0.028, 0.028)
    ]
    return trimesh.boolean.union([body, *wheels], engine="manifold")


def test_vehicle_of_square_section_stays_on_its_wheels() -> None:
    van = _van()
    assert choose_up(van, file_up="z", stands=True).turned_deg > 80, (
        "a carton of this section would be stood on its end"
    )
    stood = _stood(van, choose_up(van, file_up="z", stands=True, level=True))
    np.testing.assert_allclose(stood.extents, van.extents, atol=1e-6)
    lengthwise_y = _turned(van, (0, 0, 90))
    assert choose_up(lengthwise_y, stands=True, level=True).up == "z"


def _pump_bottle() -> trimesh.Trimesh:
    """Return a bottle 190 mm high, the head of whose pump reaches out to one side, Z up."""
    stem = trimesh.creation.cylinder(0.005, 0.06, sections=24)
    stem.apply_translation([0, 0, 0.158])
    head = trimesh.creation.box([0.05, 0.014, 0.01])
    head.apply_translation([0.016, 0, 0.188])
    body = trimesh.creation.cylinder(0.035, 0.14, sections=48)
    body.apply_translation([0, 0, 0.07])
    return trimesh.boolean.union([body, stem, head], engine="manifold")


@pytest.mark.parametrize("turn_deg", [(180, 0, 0), (90, 0, 0)])
def test_a_long_thing_that_is_upside_down_in_its_file_stands_on_its_base(turn_deg: tuple[float, float, float]) -> None:
    """Its head holds it on no table; it also rests on its side, with another axis of the file upward."""
    choice = choose_up(_turned(_pump_bottle(), turn_deg), stands=True, opens_up=True)
    up_in_file = Rotation.from_euler("xyz", turn_deg, degrees=True).apply([0.0, 0.0, 1.0])
    assert choice.rotation @ up_in_file == pytest.approx([0, 0, 1], abs=0.02)


@pytest.mark.parametrize("turn_deg", [(0, 90, 0), (0, -90, 0), (90, 0, 0), (180, 0, 0)])
def test_a_kettle_whose_file_has_another_axis_up_stands_on_its_base(turn_deg: tuple[float, float, float]) -> None:
    """It is not long, and rests tilted on its spout too. So it does where the file declares an axis that is not its own."""
    body = trimesh.creation.revolve(
        np.array([[0, 0], [0.085, 0], [0.09, 0.02], [0.08, 0.08], [0.05, 0.11], [0, 0.115]]), sections=48
    )
    bars = [([0.075, 0.055], [0.11, 0.085], 0.01), ([0.11, 0.085], [0.125, 0.112], 0.01)]
    arch = [[-0.06, 0.1], [-0.05, 0.15], [0, 0.17], [0.045, 0.15], [0.05, 0.108]]
    bars += [(first, last, 0.007) for first, last in pairwise(arch)]
    solids = [trimesh.creation.cylinder(r, segment=[[p[0], 0, p[1]], [q[0], 0, q[1]]], sections=20) for p, q, r in bars]
    kettle = trimesh.boolean.union([body, *solids], engine="manifold", check_volume=False)
    up_in_file = Rotation.from_euler("xyz", turn_deg, degrees=True).apply([0.0, 0.0, 1.0])
    for declared in (None, "z"):
        choice = choose_up(_turned(kettle, turn_deg), stands=True, opens_up=True, file_up=declared)
        assert choice.rotation @ up_in_file == pytest.approx([0, 0, 1], abs=0.02), (declared, choice.reason)
