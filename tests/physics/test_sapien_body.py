"""A body's cooked hulls serve one trial after the other, and never two at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from manitwin.physics.sapien.body import dynamic_component, hull_shapes
from manitwin.physics.sapien.trial import SapienTrial
from rigid_boxes import PANDA, SETTINGS, above, block, box

CUBE_M = [0.04, 0.04, 0.04]


def test_body_has_its_own_mass_properties_whatever_shapes_it_takes() -> None:
    body = replace(
        box(CUBE_M, 0.3), inertia_kg_m2=np.diag([3e-4, 1e-4, 2e-4]), center_of_mass_m=np.array([0.0, 0, 0.01])
    )
    two = (block([0, 0, 0], [0.1, 0.1, 0.1]), block([0.2, 0, 0], [0.3, 0.1, 0.1]))
    for shapes in (hull_shapes(two)[:1], hull_shapes(two)):
        component = dynamic_component(body, shapes)
        assert component.mass == pytest.approx(0.3)
        assert component.inertia == pytest.approx([1e-4, 2e-4, 3e-4])
        assert component.cmass_local_pose.p == pytest.approx([0, 0, 0.01])


def test_shape_of_another_body_is_refused_until_that_is_gone() -> None:
    body = box(CUBE_M, 0.3)
    shapes = hull_shapes(body.hulls)
    first = dynamic_component(body, shapes)
    with pytest.raises(RuntimeError, match="attached"):
        dynamic_component(body, shapes)
    del first
    assert len(dynamic_component(body, shapes).collision_shapes) == 1


def test_trials_on_shapes_used_before_are_those_on_fresh_ones() -> None:
    # the same hulls with other frictions and masses, as perturbed trials have them: nothing stays with the shapes
    bar = replace(
        box([0.03, 0.09, 0.04], 1.0),
        hulls=tuple(block([-0.015, y, -0.02], [0.015, y + 0.03, 0.02]) for y in (-0.045, -0.015, 0.015)),
    )
    bodies = [bar, replace(bar, mass_kg=2.5), replace(bar, friction_static=0.1, friction_dynamic=0.1), bar]
    poses = np.stack([above([0, 0.02, 0]), above([0, -0.03, 0.005])])
    trial = SapienTrial()
    again = [trial.run(body, PANDA, poses, SETTINGS) for body in bodies]
    assert again == [
        SapienTrial().run(replace(body, hulls=tuple(body.hulls)), PANDA, poses, SETTINGS) for body in bodies
    ]
    assert again[0] == again[3]
    assert again[0] != again[1]
    assert again[0] != again[2]
