"""Points by rule: always the paper's number of them, where the named part is, and where a gripper fits."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import candidates, cup, hammer, mug, screwdriver, subject
from manitwin.models.annotators.priors import load_priors, lookup
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
    handled, plain = select(mug(), "tea cup"), select(cup(), "tea cup")
    assert [point.label for point in handled.functional] == ["opening", "handle", "base"]
    assert (
        "opening of the cup" not in handled.functional[1].description
        and "the cup by" in handled.functional[1].description
    )
    assert labelled(handled, "handle") == pytest.approx(labelled(select(mug(), "mug"), "handle"))
    assert [point.label for point in plain.functional] == ["opening", "body", "base"]
    parts = [prior.parts for prior in (lookup("cup"), load_priors()["vase"]) if prior is not None and prior.with_handle]
    assert parts == ["open", "open"], "what it is without one is as before"


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
    assert lookup(None) is None


def test_the_same_request_gives_the_same_points() -> None:
    assert select(hammer(), "hammer") == select(hammer(), "hammer")


def test_what_is_too_thick_for_fingertips_is_no_pinch() -> None:
    thick = trimesh.creation.box([0.2, 0.06, 0.05]).apply_translation([0, 0, 0.025])
    thin = trimesh.creation.box([0.2, 0.02, 0.02]).apply_translation([0, 0, 0.01])
    assert "pinch" not in {point.type for point in select(thick, "box of pasta").grasp + select(thick, "remote").grasp}
    assert "pinch" in {point.type for point in select(thin, "chopstick").grasp}
