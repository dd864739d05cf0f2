"""Parts and joints of an SDF model, with its joints at zero as in its poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset_files import SHAPE_LIMITS
from manitwin.assets.audit.linkage.linkage import Linkage, MovingJoint
from manitwin.assets.audit.linkage.read import moving_joint, part_of, require_no_missing_mesh
from manitwin.assets.readers.joint_elements import sdf_joints
from manitwin.assets.readers.sdf import SdfModel, open_sdf
from manitwin.assets.readers.sdf_shapes import MODEL_FRAME, SdfShapes
from manitwin.assets.readers.upright import Y_UP_FORMATS
from manitwin.formats.xml_file import text_of

_TRUE = ("true", "1")
_AXES_OF_THE_PARENT = (1, 5)
"""Before this version, an axis was in the frame of the model (SDFormat's changelog)."""


def read(path: Path, root: Path | None = None) -> Linkage | None:
    """Read the parts and joints of an SDF model in its frame; None for a static model. Raises AssetError.

    Gazebo's engines collide with triangles, so concave meshes are left out. Links collide with each other if <self_collide> is
    set.
    """
    opened = open_sdf(path, root, SHAPE_LIMITS)
    if (text_of(opened.model, "static") or "").lower() in _TRUE:
        return None
    links = {link.get("name"): link for link in opened.model.findall("link")}
    parts_of = _parts(opened, list(links))
    gltf = any((uri.text or "").strip().lower().endswith(Y_UP_FORMATS) for uri in opened.model.iter("uri"))
    shapes = SdfShapes(opened.file, opened.frames, opened.files, turn_gltf=gltf)
    names: list[list[str]] = [[] for _ in range(1 + max(parts_of.values()))]
    for name, part in parts_of.items():
        names[part].append(name)
    parts = tuple(
        part_of(group[0], [shape for name in group for shape in shapes.collision(links[name])], convex_only=True)
        for group in names
    )
    require_no_missing_mesh(opened.files, opened.file.name)
    said = [text_of(each, "self_collide") for each in (opened.model, *links.values())]
    return Linkage(parts, tuple(_joints(opened, parts_of)), collide=any((text or "").lower() in _TRUE for text in said))


def _parts(opened: SdfModel, links: list[str]) -> dict[str, int]:
    """Return the part index of each link; links on fixed joints share one part."""
    group = {name: name for name in links}
    for joint in opened.model.findall("joint"):
        ends = _ends(opened, joint)
        if joint.get("type") == "fixed" and all(end in group for end in ends):
            one, other = (group[end] for end in ends)
            group = {name: one if head == other else head for name, head in group.items()}
    numbers = {head: number for number, head in enumerate(dict.fromkeys(group.values()))}
    return {name: numbers[head] for name, head in group.items()}


def _ends(opened: SdfModel, joint: etree._Element) -> list[str]:
    return [opened.frames.link_of((joint.findtext(tag) or "").strip()) for tag in ("parent", "child")]


def _joints(opened: SdfModel, parts_of: dict[str, int]) -> list[MovingJoint]:
    found = []
    of_parent = _version(opened.root) < _AXES_OF_THE_PARENT
    for joint, said in zip(opened.model.findall("joint"), sdf_joints(opened.model), strict=True):
        parent, child = _ends(opened, joint)
        if parent not in parts_of or child not in parts_of or parts_of[parent] == parts_of[child]:
            continue
        to_model = opened.frames.to_model(said.name if said.name not in parts_of else child)
        axes = to_model
        if of_parent or (text_of(joint, "axis/use_parent_model_frame") or "").lower() in _TRUE:
            axes = np.eye(4)
        xyz = joint.find("axis/xyz")
        stated = None if xyz is None else xyz.get("expressed_in")
        if stated:
            axes = np.eye(4) if stated == MODEL_FRAME else opened.frames.to_model(stated)
        axes = axes.copy()
        axes[:3, 3] = to_model[:3, 3]
        ends = (parts_of[parent], parts_of[child])
        axis = np.array([0.0, 0, 1]) if said.axis is None else said.axis
        found.append(moving_joint(said.name, said.kind, ends, axes, axis, (said.lower, said.upper)))
    return found


def _version(root: etree._Element) -> tuple[int, ...]:
    words = (root.get("version") or "1.6").split(".")
    return tuple(int(word) for word in words[:2] if word.isdigit()) or (1, 6)
