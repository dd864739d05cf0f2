"""Suction cup as URDF: the boxes of its gripper file, and a lip on a spring-loaded plunger."""

from __future__ import annotations

import numpy as np

from manitwin.formats.xml_file import add, new_element
from manitwin.geometry.poses import transform
from manitwin.robots.assembly import add_box_link, add_inertial, add_joint, palm_link
from manitwin.robots.grippers.suction import SuctionGripper
from manitwin.robots.urdf import UrdfTree, set_origin

LIP_M = 0.004  # height of the lip's link: the room that the compressed bellows of the file leave in front of them
_DARK = "0.1 0.1 0.11 1"


def cup_link(gripper: str) -> str:
    """Return the name of the lip's link."""
    return f"{gripper}_lip"


def cup_joint(gripper: str) -> str:
    """Return the name of the plunger's joint."""
    return f"{gripper}_plunger"


def generated_cup(gripper: SuctionGripper, mass_kg: float) -> UrdfTree:
    """Return a cup as a palm of boxes, whose frame is the grasp frame, and a lip on a prismatic joint along +Z.

    At joint position 0 the lip lies in the plane ``tip_depth_m``; the range is ``reach_m`` to either side. ``mass_kg`` is
    distributed by volume.
    """
    name, radius_m = gripper.name, gripper.lip_radius_m
    robot = new_element("robot", name=name)
    boxes = gripper.boxes(gripper.opening_m)
    lip_to_palm = transform(translation=np.array([0.0, 0.0, gripper.tip_depth_m - LIP_M / 2]))
    disc_m3 = np.pi * radius_m**2 * LIP_M
    density = mass_kg / (sum(8 * float(half.prod()) for _, half in boxes) + disc_m3)
    add_box_link(robot, palm_link(name), boxes, density)
    lip = add(robot, "link", name=cup_link(name))
    for tag in ("visual", "collision"):
        shape = add(lip, tag)
        set_origin(shape, lip_to_palm)
        add(add(shape, "geometry"), "cylinder", radius=repr(radius_m), length=repr(LIP_M))
        if tag == "visual":
            add(add(shape, "material", name=f"{name}_dark"), "color", rgba=_DARK)
    side_m = float(np.sqrt(np.pi) * radius_m / 2)  # half side of a square plate with the disc's area
    add_inertial(lip, [(lip_to_palm, np.array([side_m, side_m, LIP_M / 2]))], density)
    joint = add_joint(robot, cup_joint(name), "prismatic", palm_link(name), cup_link(name))
    set_origin(joint, np.eye(4))
    add(joint, "axis", xyz="0 0 1")
    reach = repr(gripper.reach_m)
    add(joint, "limit", lower=f"-{reach}", upper=reach, velocity="1.0", effort=repr(gripper.force_n))
    return UrdfTree(f"hand generated of gripper {name}", robot)
