"""Long bent things lie as they come to rest: on two places, with the centre of mass between them."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.config import PlacementConfig
from manitwin.geometry.hulls.reduction import convex_corners
from manitwin.geometry.solids.shapes import box
from manitwin.geometry.stable_poses import easiest_tilt, stable_poses
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import ObjectDescription
from manitwin.models.generators.templates.ground_truth import mass_properties
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.resting import pitch_to_rest, resting_pitch_rad
from manitwin.models.generators.templates.template import Model


def bar_with_a_foot(at_m: float) -> Model:
    """A bar from x = -0.1 to 0.1 m, its underside at z = 0.02 m, on a foot of 2 x 2 cm whose middle is at ``at_m``."""
    model = Model().add("bar", box(0.2, 0.02, 0.01).translate((0, 0, 0.02)))
    model.add("foot", box(0.02, 0.02, 0.021).translate((at_m, 0, 0)))
    model.region("end", "bar", lambda centers: centers[:, 0] < -0.099)
    return model.point("top", "face", "bar", (0.0, 0.0, 0.03), (0.0, 0.0, 1.0))


def test_a_bar_with_a_foot_at_its_end_tips_until_its_other_end_is_down() -> None:
    model = bar_with_a_foot(0.09)
    pitch_rad = resting_pitch_rad(model.assembly.triangles_m())
    assert pitch_rad == pytest.approx(np.arctan2(-0.02, 0.18))  # from the bar's end to the foot's inner edge
    lying = pitch_to_rest(model)
    mesh = lying.assembly.mesh()
    down = mesh.vertices[mesh.vertices[:, 2] < 1e-6]
    assert mesh.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-7) and np.ptp(down[:, 0]) > 0.17
    assert {"bar", "foot", "end"} == set(mesh.names)
    end = mesh.vertices[np.unique(mesh.faces[mesh.faces_of("end")])]
    assert end[:, 0].max() < -0.09  # a region is where it was
    (top,) = lying.points
    assert top.direction == pytest.approx((np.sin(pitch_rad), 0.0, np.cos(pitch_rad)))
    corners = mesh.vertices[mesh.faces[mesh.faces_of("bar")]]
    away = np.abs((np.array(top.position_m) - corners[:, 0]) @ np.array(top.direction))
    assert away.min() < 1e-6  # it is on the bar's upper side still


def test_a_bar_whose_foot_is_below_its_middle_stays_level() -> None:
    assert resting_pitch_rad(bar_with_a_foot(0.0).assembly.triangles_m()) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("category", "head"), [("spoon", "bowl"), ("fork", "tines"), ("spatula", "blade")])
@pytest.mark.parametrize("seed", range(3))
def test_cutlery_is_on_the_table_with_its_head_and_its_handle(category: str, head: str, seed: int) -> None:
    template = load_templates()[category]
    mesh = template.build(**template.sample_measures(np.random.default_rng(seed))).assembly.mesh()
    length_m = np.ptp(mesh.vertices[:, 0])
    names = {head, "neck", "edge"} & set(mesh.names)
    heads = mesh.vertices[np.unique(np.concatenate([mesh.faces[mesh.faces_of(name)].ravel() for name in names]))]
    handle = mesh.vertices[np.unique(mesh.faces[mesh.faces_of("handle")])]
    assert heads[:, 2].min() < 1e-3 and handle[:, 2].min() < 1e-5  # a spatula is on the root of its handle
    down = mesh.vertices[mesh.vertices[:, 2] < 1e-5]
    assert np.ptp(down[:, 0]) > 0.3 * length_m


def test_the_handle_of_a_spatula_rises_at_its_neck_as_much_as_is_said() -> None:
    template = load_templates()["spatula"]

    def thickness(**measures: float) -> float:
        mesh = template.build(**template.typical_measures() | measures).assembly.mesh()
        return float(np.ptp(mesh.vertices[:, 2]))

    assert (
        thickness(rise=0.24, crank=0.9) > 1.5 * thickness(rise=0.24, crank=0.2) > 1.5 * thickness(rise=0.04, crank=0.2)
    )


@pytest.mark.parametrize("category", ["spoon", "fork", "spatula"])
@pytest.mark.parametrize("seed", range(4))
def test_drawn_cutlery_lies_in_some_way_that_a_slight_tilt_does_not_turn_over(category: str, seed: int) -> None:
    template, settings = load_templates()[category], PlacementConfig()
    thing = make_object(template, ObjectDescription(category), np.random.default_rng(seed))
    _, center, _ = mass_properties(thing.solids)
    corners = convex_corners(thing.mesh.vertices)[0]
    poses = np.array([pose.rotation for pose in stable_poses(corners, center)[:60]])
    rises_m, _ = easiest_tilt(corners, center, poses, np.radians(settings.max_turned_deg))
    assert rises_m.max() > settings.tilt_rise_m  # a spoon whose handle was arched by 0.5 and more had none
