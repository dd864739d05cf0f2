"""What the pads meet on a box, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.poses import transform
from manitwin.geometry.ray_caster import RayCaster
from manitwin.physics.grasp_filters import ACROSS, ALONG, PadContacts, pad_contacts
from manitwin.robots.grippers.gripper import load_gripper

PANDA = load_gripper("panda")
FROM_ABOVE = np.diag([1.0, -1.0, -1.0])


def contacts_at(tip_m: list[float], extents_m: list[float], center_of_mass_m: list[float]) -> PadContacts:
    pose = transform(FROM_ABOVE, np.add(tip_m, [0, 0, PANDA.tip_depth_m]))
    caster = RayCaster(trimesh.creation.box(extents_m))
    return pad_contacts(PANDA, pose[None], caster, np.array(center_of_mass_m))


def test_pads_on_a_box_touch_with_all_cells_as_far_apart_as_it_is_wide() -> None:
    contacts = contacts_at([0, 0, 0], [0.04, 0.06, 0.05], [0, 0, 0])
    assert contacts.width_m[0] == pytest.approx(0.04, abs=1e-6)
    assert contacts.cells[0] == ACROSS * ALONG
    assert contacts.offset_m[0] == pytest.approx(0, abs=1e-9)
    assert contacts.alignment[0] == pytest.approx(1)


def test_lever_is_the_distance_of_the_center_of_mass_from_the_closing_line() -> None:
    assert contacts_at([0, 0, 0], [0.04, 0.06, 0.05], [0.01, 0.03, -0.04]).lever_m[0] == pytest.approx(0.05)


def test_pads_at_the_edge_touch_with_fewer_cells() -> None:
    # the middle row of rays and one beside it, of three, lie over the box
    contacts = contacts_at([0, 0.028, 0], [0.04, 0.06, 0.05], [0, 0, 0])
    assert contacts.cells[0] == 2 * ALONG


def test_pads_in_the_air_have_no_width() -> None:
    contacts = contacts_at([0, 0, 0.1], [0.04, 0.06, 0.05], [0, 0, 0])
    assert np.isinf(contacts.width_m[0])
    assert contacts.cells[0] == 0


def test_slanted_faces_are_told_by_their_alignment() -> None:
    wedge = trimesh.creation.cone(radius=0.03, height=0.03, sections=256)  # 45 degrees all around
    pose = transform(FROM_ABOVE, [0, 0, 0.012 + PANDA.tip_depth_m])
    contacts = pad_contacts(PANDA, pose[None], RayCaster(wedge), np.zeros(3))
    assert contacts.alignment[0] == pytest.approx(np.sqrt(0.5), abs=0.05)
