"""What a robot's links look like: the visual shapes of its URDF, and where they are at given joints."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh

from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.readers.urdf_shapes import LinkShapes
from manitwin.render.drawable import Drawable, drawable
from manitwin.robots.links import links_of_urdf, poses_at
from manitwin.robots.robot import Robot
from manitwin.robots.urdf import UrdfTree


@lru_cache(maxsize=4)
def _visuals(urdf: str) -> dict[str, tuple[trimesh.Trimesh, ...]]:
    tree = UrdfTree.of_text(urdf)
    shapes = LinkShapes(tree, Path("robot.urdf"), AssetFiles(Path(Path.cwd().anchor)))
    parts = {name: tuple(shapes.visual(link, np.eye(4))) for name, link in tree.links.items()}
    return {name: found for name, found in parts.items() if found}


def link_visuals(robot: Robot) -> dict[str, tuple[trimesh.Trimesh, ...]]:
    """Return the visual parts of the links that have any, by name, in the links' frames.

    COLLADA files keep their own colours, STL files and plain shapes have those of the URDF. Raises AssetError where a mesh
    cannot be read.
    """
    return _visuals(robot.urdf)


@lru_cache(maxsize=4)
def _drawables(urdf: str, tolerance_m: float) -> dict[str, Drawable]:
    return {link: drawable(parts, tolerance_m=tolerance_m) for link, parts in _visuals(urdf).items()}


def link_drawables(robot: Robot, *, tolerance_m: float) -> dict[str, Drawable]:
    """Return the links that have visual parts, ready to be drawn, simplified by about a tolerance; kept for the next call."""
    return _drawables(robot.urdf, tolerance_m)


def link_poses(robot: Robot, joint_positions_rad: np.ndarray, gripper_opening_m: float) -> dict[str, np.ndarray]:
    """Return every link's ``link_to_world (4, 4)``, by name; the fingers stand at half of the opening each.

    ``joint_positions_rad`` are the arm's, in the order of ``robot.arm_joints``; fingers that a recording has in front of
    them follow the opening alone.
    """
    joints = dict(zip(robot.arm_joints, np.asarray(joint_positions_rad, float), strict=False))
    joints.update(dict.fromkeys(robot.finger_joints, float(gripper_opening_m) / 2))
    return poses_at(links_of_urdf(robot.urdf), joints)


def tip_pose(robot: Robot, joint_positions_rad: np.ndarray) -> np.ndarray:
    """Return ``gripper_to_world (4, 4)`` of the grasp frame (+Z approach, X closing)."""
    return link_poses(robot, joint_positions_rad, 0.0)[robot.tip_link] @ robot.gripper_to_tip
