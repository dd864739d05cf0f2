"""The visual shapes of a URDF in SAPIEN against their closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import sapien
from sapien import physx

from manitwin.geometry.poses import transform
from manitwin.physics.sapien.visuals import add_robot_visuals
from manitwin.render.device import render_scene

URDF = """
<robot name="shapes">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base">
    <visual><origin xyz="0 0 1"/><geometry><box size="0.1 0.2 0.3"/></geometry><material name="red"/></visual>
  </link>
  <link name="mast">
    <visual><geometry><cylinder radius="0.1" length="0.8"/></geometry></visual>
    <visual><origin xyz="0 0 0.5"/><geometry><sphere radius="0.2"/></geometry></visual>
  </link>
  <joint name="fixed" type="fixed"><parent link="base"/><child link="mast"/></joint>
</robot>
"""


def test_shapes_of_all_links_of_a_body_have_their_sizes_places_and_colours() -> None:
    _rendering = render_scene({})
    entity = sapien.Entity()
    body = physx.PhysxArticulationLinkComponent(None)
    entity.add_component(body)
    mast_to_base = transform(None, np.array([2.0, 0, 0]))
    add_robot_visuals(URDF, {"base": body}, {"base": ("base", np.eye(4)), "mast": ("base", mast_to_base)})
    (component,) = (c for c in entity.components if isinstance(c, sapien.render.RenderBodyComponent))
    box, mast, ball = component.render_shapes
    assert np.asarray(box.half_size) == pytest.approx([0.05, 0.1, 0.15])
    assert np.asarray(box.local_pose.p) == pytest.approx([0, 0, 1])
    assert np.asarray(box.material.base_color) == pytest.approx([1, 0, 0, 1])
    assert (mast.radius, mast.half_length) == pytest.approx((0.1, 0.4))
    upright = mast.local_pose.to_transformation_matrix()
    assert np.abs(upright[:3, 0]) == pytest.approx([0, 0, 1], abs=1e-6)  # SAPIEN's cylinders lie along X
    assert upright[:3, 3] == pytest.approx([2, 0, 0])
    assert ball.radius == pytest.approx(0.2)
    assert np.asarray(ball.local_pose.p) == pytest.approx([2, 0, 0.5])
