"""Points by rule: always the paper's number of them, where the named part is, and where a gripper fits."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import trimesh

from handmade import candidates, cup, hammer, mug, screwdriver, subject
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.annotators.protocol import PointsRequest, SelectedPoints
from manitwin.models.annotators.rules import RulesAnnotator


def request(mesh: trimesh.Trimesh, name: str | None, **changes: object) -> PointsRequest:
    positions, normals = candidates(mesh)
    values = {
        "subject": subject(mesh, name), "positions_m": positions, "normals": normals, "marked_views": (),
        "visible": (tuple(range(len(positions))),), "center_of_mass_m": mesh.center_mass, "max_opening_m": 0.08,
    }  # fmt: skip
    return PointsRequest(**{**values, **changes})


def select(mesh: trimesh.Trimesh, name: str | None, **changes: object) -> SelectedPoints:
    return RulesAnnotator().select_points(request(mesh, name, **changes))


def labelled(selected: SelectedPoints, label: str) -> np.ndarray:
    return np.array(next(point.position_m for point in selected.functional if point.label == label))


def test_a_mug_is_held_by_its_handle_and_poured_from_its_rim() -> None:
    selected = select(mug(), "mug")
    handle, opening = labelled(selected, "handle"), labelled(selected, "opening")
    assert np.hypot(*handle[:2]) > 0.05 and handle[0] > 0.04
    assert opening[2] > 0.09 and opening[0] < 0.03
    assert selected.grasp[0].position_m[0] > 0.05
    assert [point.type for point in selected.grasp] == ["parallel_jaw", "pinch", "power"]


def test_a_cup_with_a_handle_is_held_by_it_and_one_without_is_not() -> None:
    handled, plain = select(mug(), "drinking cup"), select(cup(), "drinking cup")
    assert [point.label for point in handled.functional] == ["opening", "handle", "base"]
    assert (
        "opening of the cup" not in handled.functional[1].description
        and "the cup by" in handled.functional[1].description
    )
    assert labelled(handled, "handle") == pytest.approx(labelled(select(mug(), "mug"), "handle"))
    assert [point.label for point in plain.functional] == ["opening", "body", "base"]
    parts = [
        prior.parts for prior in (find_prior("cup"), load_priors()["vase"]) if prior is not None and prior.with_handle
    ]
    assert parts == ["open", "open"], "what it is without one is as before"


def bottle(*, handle: bool, wide_m: float = 0.07) -> trimesh.Trimesh:
    """A closed bottle, 70 mm deep and 200 mm tall, with a ring of a handle at +x or without; oval where it is wider."""
    profile = np.array([(0, 0), (35, 0), (35, 140), (15, 165), (15, 200), (0, 200)]) / 1000.0
    body = trimesh.creation.revolve(profile, sections=48)
    body.apply_scale((wide_m / 0.07, 1, 1))
    if not handle:
        return body
    ring = trimesh.creation.torus(major_radius=0.035, minor_radius=0.006)
    ring.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    return trimesh.boolean.union([body, ring.apply_translation((0.042, 0, 0.09))], engine="manifold")


def test_a_bottle_with_a_handle_is_lifted_by_it_and_one_that_is_only_flat_has_none() -> None:
    with_one, without = select(bottle(handle=True), "thermos"), select(bottle(handle=False), "thermos")
    assert labelled(with_one, "handle")[0] > 0.04 and with_one.grasp[0].scenario.endswith("by the handle")
    assert "handle" not in [point.label for point in without.functional]
    flat = select(bottle(handle=False, wide_m=0.12), "shampoo bottle")
    assert [point.label for point in flat.functional] == ["cap", "body", "base"]


@pytest.mark.parametrize("sides_m", [(0.07, 0.07), (0.09, 0.06)])
def test_corners_of_a_square_glass_are_no_handles(sides_m: tuple[float, float]) -> None:
    outside = trimesh.creation.box((*sides_m, 0.1))
    inside = trimesh.creation.box((sides_m[0] - 0.006, sides_m[1] - 0.006, 0.1)).apply_translation((0, 0, 0.004))
    glass = trimesh.boolean.difference([outside, inside], engine="manifold").apply_translation((0, 0, 0.05))
    assert "handle" not in [point.label for point in select(glass, "glass").functional]


def test_what_is_no_hollow_and_no_tray_has_no_inside() -> None:
    post, slab = trimesh.creation.box((0.06, 0.06, 0.12)), trimesh.creation.box((0.2, 0.15, 0.03))
    for mesh, has_one in ((post, False), (slab, True)):
        labels = [
            point.label
            for point in select(mesh.apply_translation((0, 0, -mesh.bounds[0, 2])), "storage box").functional
        ]
        assert ("inside" in labels) is has_one, labels


def test_a_hammer_strikes_with_its_head_and_is_held_by_its_handle() -> None:
    selected = select(hammer(), "hammer")
    assert labelled(selected, "head")[0] < 0.03
    face = labelled(selected, "striking face")
    assert abs(face[1]) > 0.04 and face[0] < 0.03
    assert all(0.02 < point.position_m[0] < 0.25 for point in selected.grasp)


def test_a_screwdriver_works_with_its_thin_end() -> None:
    selected = select(screwdriver(), "screwdriver")
    assert labelled(selected, "tip")[0] < 0.01
    assert labelled(selected, "handle")[0] > 0.1


def test_places_that_are_parts_lie_on_them() -> None:
    bars = []
    for angle in (0.35, -0.35):
        bar = trimesh.creation.box((0.16, 0.014, 0.014))
        bar.apply_transform(trimesh.transformations.rotation_matrix(angle, [0, 0, 1]))
        bars.append(bar)
    crossed = trimesh.boolean.union(bars).subdivide_to_size(0.01)
    selected = select(trimesh.Trimesh(crossed.vertices, crossed.faces), "clamp")
    jaws, joint, handles = (labelled(selected, label)[0] for label in ("jaws", "spring joint", "handles"))
    assert abs(joint) < 0.03 and min(abs(jaws), abs(handles)) > 0.033 and jaws * handles < 0


def test_two_sides_of_a_thin_wall_are_two_places() -> None:
    """The middle of a saucer's underside is 3 mm from that of its surface, and no less its base."""
    saucer = trimesh.creation.cylinder(radius=0.07, height=0.003, sections=64)
    saucer.apply_translation([0, 0, 0.0015])
    around = 0.06 * np.column_stack([np.cos(np.arange(6)), np.sin(np.arange(6)), np.zeros(6)])
    above = np.array([0, 0, 0.003])
    places = np.vstack([above, around + above, np.zeros(3), around])
    normals = np.repeat([[0.0, 0, 1], [0.0, 0, -1]], 7, axis=0)
    selected = select(saucer, "saucer", positions_m=places, normals=normals, visible=(tuple(range(14)),))
    assert np.allclose(labelled(selected, "surface"), [0, 0, 0.003])
    grasps = [point.candidate for point in selected.grasp]
    assert np.allclose(labelled(selected, "base"), 0) and len(set(grasps)) == len(grasps)


def test_an_empty_middle_is_held_by_the_rim() -> None:
    bowl = cup(radius_m=0.075, height_m=0.07, wall_m=0.004)
    for point in select(bowl, "bowl").grasp:
        assert point.position_m[2] > 0.06


def test_a_body_held_by_its_side_is_held_from_the_other_side_too() -> None:
    points = select(trimesh.creation.box([0.05, 0.09, 0.2]).apply_translation([0, 0, 0.1]), "mustard bottle").grasp
    sides = [np.array(point.normal) for point in points if abs(point.normal[2]) < 0.3]
    assert len(points) == 3
    assert min(float(a @ b) for a in sides for b in sides) < -0.7
    assert "other side" in points[-1].scenario


def test_a_grasp_avoids_what_is_wider_than_the_gripper_opens() -> None:
    box = trimesh.creation.box([0.2, 0.15, 0.05])
    box.apply_translation([0, 0, 0.025])
    for name in ("box", None):
        held = select(box, name).grasp[0]
        assert abs(held.normal[2]) == pytest.approx(1.0), "across the 50 mm, not the 150 mm"


def test_points_are_chosen_among_the_visible() -> None:
    mesh = mug()
    positions, _ = candidates(mesh)
    seen = tuple(int(i) for i in np.flatnonzero(positions[:, 1] < 0.001))
    selected = select(mesh, "mug", visible=(seen, ()))
    assert {point.candidate for point in (*selected.functional, *selected.grasp)} <= set(seen)


def one_of_each_form() -> list[str | None]:
    """One category for each set of parts that the table has, and none."""
    forms = {(prior.functional[0].feature, prior.grasp, prior.head_end): name for name, prior in load_priors().items()}
    return [*sorted(forms.values()), None]


@pytest.mark.parametrize("name", one_of_each_form())
def test_every_form_gets_its_points_on_any_shape(name: str | None) -> None:
    selected = select(trimesh.creation.box([0.11, 0.05, 0.03]), name)
    assert 2 <= len(selected.functional) <= 4 and 2 <= len(selected.grasp) <= 3
    for points, letter in ((selected.functional, "f"), (selected.grasp, "g")):
        assert [point.id for point in points] == [f"{letter}{i}" for i in range(len(points))]
        assert len({point.candidate for point in points}) == len(points)
        assert all(point.rationale and 0 < point.confidence < 1 for point in points)


def test_without_a_name_the_rule_is_less_sure() -> None:
    named, unnamed = select(mug(), "mug"), select(mug(), None)
    assert max(p.confidence for p in unnamed.grasp) < min(p.confidence for p in named.functional)
    assert find_prior(None) is None


def test_the_same_request_gives_the_same_points() -> None:
    assert select(hammer(), "hammer") == select(hammer(), "hammer")


def test_what_is_too_thick_for_fingertips_is_no_pinch() -> None:
    thick = trimesh.creation.box([0.2, 0.06, 0.05]).apply_translation([0, 0, 0.025])
    thin = trimesh.creation.box([0.2, 0.02, 0.02]).apply_translation([0, 0, 0.01])
    assert "pinch" not in {point.type for point in select(thick, "box of pasta").grasp + select(thick, "remote").grasp}
    assert "pinch" in {point.type for point in select(thin, "chopstick").grasp}


def bars(*segments: tuple[list[float], list[float], float]) -> list[trimesh.Trimesh]:
    """Return round bars between two points each, of a radius (m)."""
    return [trimesh.creation.cylinder(radius, segment=[first, last], sections=20) for first, last, radius in segments]


def block(extents_m: tuple[float, float, float], center_m: tuple[float, float, float]) -> trimesh.Trimesh:
    made = trimesh.creation.box(extents_m)
    made.apply_translation(center_m)
    return made


def joined(*solids: trimesh.Trimesh) -> trimesh.Trimesh:
    fine = trimesh.boolean.union(solids, engine="manifold", check_volume=False).subdivide_to_size(0.012)
    return trimesh.Trimesh(fine.vertices, fine.faces)


def turned(mesh: trimesh.Trimesh, deg: float) -> trimesh.Trimesh:
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.radians(deg), [0, 0, 1]))
    return mesh


def test_a_nozzle_is_the_outlet_that_a_pump_or_trigger_reaches_out_with() -> None:
    body, stem = bars(([0, 0, 0], [0, 0, 0.15], 0.035), ([0, 0, 0.15], [0, 0, 0.19], 0.008))
    pump = joined(body, stem, block((0.05, 0.014, 0.01), (0.016, 0, 0.188)))
    assert labelled(select(pump, "soap dispenser"), "nozzle")[0] > 0.035
    head, trigger = block((0.08, 0.026, 0.035), (0.02, 0, 0.2)), block((0.01, 0.01, 0.04), (0.035, 0, 0.17))
    spray = labelled(select(joined(body, stem, head, trigger), "spray bottle"), "nozzle")
    assert spray[0] > 0.05 and spray[2] > 0.18
    cap = joined(body, *bars(([0, 0, 0.15], [0, 0, 0.18], 0.02)))
    assert labelled(select(cap, "soap dispenser"), "nozzle")[2] > 0.17, "a round one has no side"


def test_an_axe_splits_with_its_edge_and_strikes_with_no_face() -> None:
    corners = ((-0.02, -0.01, 0.012), (0.04, -0.01, 0.012), (-0.03, 0.1, 0.0), (0.07, 0.1, 0.0))
    head = trimesh.convex.convex_hull(np.array([(x, y, s * z) for x, y, z in corners for s in (1, -1)]))
    selected = select(joined(head, *bars(([0.0, 0, 0], [0.4, 0, 0], 0.012))), "axe")
    assert labelled(selected, "blade edge")[1] > 0.08
    assert [point.label for point in selected.functional] == ["head", "blade edge", "handle"]


def test_fingers_go_into_the_rings_of_scissors_and_not_between_their_shanks() -> None:
    halves = []
    for side in (1, -1):
        ring = trimesh.creation.torus(0.016, 0.004)
        ring.apply_translation((0.14, 0.022 * side, 0))
        blade = trimesh.convex.convex_hull(
            np.array(
                [
                    (x, y, z * side)
                    for x, y in ((0.0, -0.02 * side), (0.08, 0), (0.075, -0.012 * side))
                    for z in (0, 0.003)
                ]
            )
        )
        halves += [ring, blade, *bars(([0.075, 0, 0.002 * side], [0.127, 0.016 * side, 0.002 * side], 0.004))]
    selected = select(joined(*halves), "scissors")
    assert labelled(selected, "finger holes")[0] > 0.124
    assert next(point for point in selected.grasp if point.type == "pinch").position_m[0] > 0.124


def test_bristles_are_on_the_side_that_a_bent_head_turns_to() -> None:
    turn = trimesh.transformations.rotation_matrix(np.radians(30), [0, 1, 0])
    head = [block((0.06, 0.025, 0.008), (0.03, 0, 0)), block((0.055, 0.022, 0.02), (0.03, 0, -0.013))]
    for solid in head:
        solid.apply_transform(turn)
    bristles = labelled(select(joined(*head, *bars(([-0.2, 0, 0], [0.005, 0, 0], 0.007))), "dish brush"), "bristles")
    down = np.linalg.inv(turn)[:3, :3] @ bristles
    assert down[2] < -0.015 and down[0] > 0.01, "below the block that holds them"


def test_a_corkscrew_turns_its_thin_end_into_the_cork() -> None:
    handle, shank = bars(([0, -0.045, 0], [0, 0.045, 0], 0.011), ([0, 0, 0], [0.1, 0, 0], 0.004))
    selected = select(joined(handle, shank), "corkscrew")
    assert labelled(selected, "worm")[0] > 0.04 and labelled(selected, "handle")[0] < 0.02


def test_a_coat_hanger_has_a_hook_and_shoulders() -> None:
    bar = bars(
        ([-0.2, 0, 0], [0.2, 0, 0], 0.004), ([-0.2, 0, 0], [0, 0.09, 0], 0.004), ([0.2, 0, 0], [0, 0.09, 0], 0.004)
    )
    hook = bars(
        ([0, 0.09, 0], [0, 0.12, 0], 0.003),
        ([0, 0.12, 0], [0.02, 0.14, 0], 0.003),
        ([0.02, 0.14, 0], [0, 0.165, 0], 0.003),
    )
    for sign in (1, -1):
        selected = select(turned(joined(*bar, *hook), 90 - 90 * sign), "coat hanger")
        assert sign * labelled(selected, "hook")[1] > 0.14
        assert abs(labelled(selected, "shoulder")[0]) > 0.15


def test_a_basket_is_carried_by_the_handle_that_goes_over_it_where_it_has_one() -> None:
    open_box = trimesh.boolean.difference(
        [block((0.2, 0.14, 0.11), (0, 0, 0.055)), block((0.19, 0.13, 0.11), (0, 0, 0.06))], engine="manifold"
    )
    arch = [[0.095 * np.cos(t), 0.0, 0.105 + 0.11 * np.sin(t)] for t in np.linspace(0, np.pi, 14)]
    handle = bars(*((first, last, 0.005) for first, last in pairwise(arch)))
    carried, plain = select(joined(open_box, *handle), "basket"), select(joined(open_box), "basket")
    assert labelled(carried, "handle")[2] > 0.19 and carried.grasp[0].position_m[2] > 0.15
    assert [point.label for point in plain.functional] == ["opening", "inside", "base"]


def test_a_comb_has_teeth_on_one_side_and_a_spine_on_the_other() -> None:
    comb = trimesh.creation.box((0.16, 0.03, 0.004))
    slots = [
        trimesh.creation.box((0.002, 0.02, 0.01), trimesh.transformations.translation_matrix((x, -0.01, 0)))
        for x in np.linspace(-0.07, 0.07, 36)
    ]
    selected = select(trimesh.boolean.difference([comb, *slots], engine="manifold"), "hair comb")
    assert labelled(selected, "teeth")[1] < -0.008 and labelled(selected, "spine")[1] > 0.008
    plain = select(comb, "hair comb")
    assert not {"teeth", "spine"} & {point.label for point in plain.functional}


@pytest.mark.parametrize("turn_rad", [0.0, 0.7, 2.5])
def test_the_dial_of_a_watch_is_on_its_case_and_not_on_its_strap(turn_rad: float) -> None:
    loop = trimesh.creation.annulus(0.03, 0.032, 0.02, sections=64)
    box = trimesh.creation.box((0.012, 0.034, 0.034), trimesh.transformations.translation_matrix((0.034, 0, 0)))
    watch = trimesh.boolean.union([loop, box], engine="manifold")
    watch.apply_transform(trimesh.transformations.rotation_matrix(turn_rad, (0, 0, 1)))
    selected = select(watch, "wrist watch")
    out = np.array([np.cos(turn_rad), np.sin(turn_rad), 0])
    assert labelled(selected, "dial") @ out > 0.036 and labelled(selected, "strap") @ out < 0.01
    ring = select(trimesh.creation.annulus(0.03, 0.034, 0.02, sections=64), "wrist watch")
    assert not {"dial", "strap"} & {point.label for point in ring.functional}


def test_a_camera_that_stands_has_its_lens_in_front_and_its_controls_on_top() -> None:
    body = trimesh.creation.box((0.12, 0.04, 0.07))
    tube = trimesh.creation.cylinder(0.025, 0.05, sections=48)
    tube.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    tube.apply_translation((0.01, -0.03, 0))
    selected = select(trimesh.boolean.union([body, tube], engine="manifold"), "camera")
    assert labelled(selected, "lens")[1] < -0.045
    assert labelled(selected, "controls")[2] > 0.03 and labelled(selected, "controls")[1] > -0.025


@pytest.mark.parametrize("span_m", [0.14, 0.24])
@pytest.mark.parametrize("turn_rad", [0.0, 0.6])
def test_a_wing_is_on_one_side_and_an_end_at_nose_or_tail(turn_rad: float, span_m: float) -> None:
    """Wings may be wider than it is long: their tips were the nose.

    The smallest box stands askew around the cross of hull and wings: its ends were neither's, and one of them the 'front'.
    """
    hull = trimesh.creation.box((0.18, 0.03, 0.03), trimesh.transformations.translation_matrix((0, 0, 0.015)))
    wing = trimesh.creation.box((0.03, span_m, 0.006), trimesh.transformations.translation_matrix((0.02, 0, 0.012)))
    tail = trimesh.creation.box((0.02, 0.05, 0.006), trimesh.transformations.translation_matrix((-0.08, 0, 0.02)))
    aircraft = trimesh.boolean.union([hull, wing, tail], engine="manifold")
    aircraft.apply_transform(trimesh.transformations.rotation_matrix(turn_rad, (0, 0, 1)))
    selected = select(aircraft, "toy airplane")
    ahead = np.array([np.cos(turn_rad), np.sin(turn_rad), 0])
    aside = np.array([-np.sin(turn_rad), np.cos(turn_rad), 0])
    assert abs(labelled(selected, "end") @ ahead) > 0.08 and abs(labelled(selected, "end") @ aside) < 0.03
    assert abs(labelled(selected, "wing") @ aside) > 0.4 * span_m - 0.006


@pytest.mark.parametrize(("crook_m", "cover_m"), [(0.05, 0.03), (0.03, 0.045)])
def test_the_crook_of_an_umbrella_is_its_handle_and_not_its_wide_end(crook_m: float, cover_m: float) -> None:
    shaft = trimesh.creation.cylinder(0.005, segment=[[-0.05, 0, 0], [0.75, 0, 0]], sections=24)
    cover = trimesh.creation.cone(cover_m, 0.55, sections=32)
    cover.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (0, 1, 0)))
    cover.apply_translation((0.1, 0, 0))
    bow = [(-0.05 - crook_m * np.sin(angle), crook_m * (1 - np.cos(angle)), 0.0) for angle in np.linspace(0, np.pi, 12)]
    crook = [trimesh.creation.cylinder(0.008, segment=pair, sections=20) for pair in pairwise(bow)]
    umbrella = trimesh.boolean.union([shaft, cover, *crook], engine="manifold", check_volume=False)
    selected = select(umbrella, "umbrella")
    assert labelled(selected, "tip")[0] > 0.7 and labelled(selected, "handle")[0] < -0.03


def test_a_dumbbell_is_lifted_by_its_bar() -> None:
    bar = trimesh.creation.cylinder(0.015, segment=[[-0.08, 0, 0], [0.08, 0, 0]])
    ends = [trimesh.creation.cylinder(0.04, segment=[[s * 0.1, 0, 0], [s * 0.05, 0, 0]], sections=6) for s in (-1, 1)]
    selected = select(trimesh.boolean.union([bar, *ends], engine="manifold"), "dumbbell")
    assert abs(labelled(selected, "handle")[0]) < 0.04 and abs(labelled(selected, "weight")[0]) > 0.06
    assert selected.grasp[0].type == "power" and abs(selected.grasp[0].position_m[0]) < 0.04


def test_a_teapot_with_its_lid_on_has_a_lid_and_a_jug_without_one_an_opening() -> None:
    body = trimesh.creation.cylinder(0.05, segment=[[0, 0, 0], [0, 0, 0.1]], sections=48)
    spout = trimesh.creation.cylinder(0.01, segment=[[0.04, 0, 0.04], [0.09, 0, 0.095]], sections=24)
    bow = [(-0.045 - 0.035 * np.sin(angle), 0, 0.05 + 0.03 * np.cos(angle)) for angle in np.linspace(0, np.pi, 10)]
    handle = [trimesh.creation.cylinder(0.006, segment=pair, sections=16) for pair in pairwise(bow)]
    knob = trimesh.creation.cylinder(0.01, segment=[[0, 0, 0.1], [0, 0, 0.115]], sections=24)
    closed = trimesh.boolean.union([body, spout, *handle, knob], engine="manifold", check_volume=False)
    hollow = trimesh.creation.cylinder(0.046, segment=[[0, 0, 0.005], [0, 0, 0.15]], sections=48)
    labels = {point.label for point in select(closed, "teapot").functional}
    assert "lid" in labels and "opening" not in labels
    opened = trimesh.boolean.difference([closed, hollow], engine="manifold", check_volume=False)
    assert "opening" in {point.label for point in select(opened, "teapot").functional}


def test_a_door_knob_is_held_by_its_knob_and_a_staplers_arm_is_above() -> None:
    plate = trimesh.creation.box((0.1, 0.065, 0.025), trimesh.transformations.translation_matrix((0, 0, 0.0125)))
    neck = trimesh.creation.cylinder(0.01, segment=[[0, 0, 0.02], [0, 0, 0.05]], sections=32)
    knob = trimesh.creation.icosphere(subdivisions=3, radius=0.025)
    knob.apply_translation((0, 0, 0.055))
    held = select(trimesh.boolean.union([plate, neck, knob], engine="manifold"), "doorknob").grasp[0]
    assert held.position_m[2] > 0.06 and "knob" in held.scenario
    base = trimesh.creation.box((0.12, 0.03, 0.01), trimesh.transformations.translation_matrix((0, 0, 0.005)))
    hinge = trimesh.creation.box((0.03, 0.02, 0.03), trimesh.transformations.translation_matrix((-0.045, 0, 0.015)))
    arm = trimesh.creation.box((0.12, 0.028, 0.012), trimesh.transformations.translation_matrix((0, 0, 0.034)))
    stapler = select(trimesh.boolean.union([base, hinge, arm], engine="manifold"), "stapler")
    assert labelled(stapler, "arm")[2] > 0.035
