"""Parts and joints of a URDF; links on fixed joints form one part."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from manitwin.assets.asset_files import SHAPE_LIMITS
from manitwin.assets.audit.linkage.linkage import Linkage, MovingJoint
from manitwin.assets.audit.linkage.read import moving_joint, part_of, require_no_missing_mesh
from manitwin.assets.readers.joint_elements import urdf_joints
from manitwin.assets.readers.upright import Y_UP_FORMATS
from manitwin.assets.readers.urdf import open_urdf
from manitwin.assets.readers.urdf_shapes import LinkShapes
from manitwin.robots.urdf import UrdfTree, child_of, origin_of, parent_of


def read(path: Path, root: Path | None = None) -> Linkage:
    """Read the parts and joints of a URDF, in the axes of its root link; raises AssetError.

    glTF meshes are turned upright, as in Drake and Gazebo.
    """
    found = open_urdf(path, root, SHAPE_LIMITS)
    tree, links = found.tree, found.tree.links
    poses, part_of_link, joints = _loading_pose(tree)
    names: list[list[str]] = [[] for _ in range(1 + max(part_of_link.values()))]
    for name, part in part_of_link.items():
        names[part].append(name)
    gltf = any((mesh.get("filename") or "").lower().endswith(Y_UP_FORMATS) for mesh in tree.element.iter("mesh"))
    shapes = LinkShapes(tree, found.file, found.files, turn_gltf=gltf)
    parts = tuple(
        part_of(group[0], [shape for name in group for shape in shapes.collision(links[name], poses[name])])
        for group in names
    )
    require_no_missing_mesh(found.files, found.file.name)
    return Linkage(parts, tuple(joints))


def _loading_pose(tree: UrdfTree) -> tuple[dict[str, np.ndarray], dict[str, int], list[MovingJoint]]:
    """Return the pose ``(4, 4)`` of each link, parents first, the part index of each link, and the joints between parts."""
    declared = {joint.name: joint for joint in urdf_joints(tree)}
    hanging: dict[str, list[str]] = {}
    for name, joint in tree.joints.items():
        hanging.setdefault(parent_of(joint), []).append(name)
    order = tree.roots()
    poses = {name: np.eye(4) for name in order}
    parts = {name: number for number, name in enumerate(order)}
    joints: list[MovingJoint] = []
    count = len(order)
    for link in order:
        for name in hanging.get(link, []):
            element, said = tree.joints[name], declared[name]
            child = child_of(element)
            order.append(child)
            pose = poses[link] @ origin_of(element)
            if said.kind == "fixed":
                poses[child], parts[child] = pose, parts[link]
                continue
            parts[child], count = count, count + 1
            kind = "fixed" if said.follows is not None else said.kind  # another joint drives it
            moving = moving_joint(name, kind, (parts[link], parts[child]), pose, said.axis, (said.lower, said.upper))
            joints.append(moving)
            poses[child] = moving.displacement(moving.start) @ pose
    return poses, parts, joints
