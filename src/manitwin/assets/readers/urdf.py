"""URDF: the first object of it that is rigid, links that fixed joints join taken as one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset import Asset, Contact
from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.detect import only_file
from manitwin.assets.licence_text import stated_licence
from manitwin.assets.readers.urdf_contact import declared_contact
from manitwin.assets.readers.urdf_inertial import declared_inertial
from manitwin.assets.readers.urdf_shapes import LinkShapes
from manitwin.errors import AssetError
from manitwin.formats.xml_file import comments_before, origin_of, parse_xml


@dataclass(frozen=True)
class UrdfTree:
    """A URDF with the links of the object that is read, each with its pose in the first one's frame."""

    file: Path
    robot: etree._Element
    links: tuple[tuple[etree._Element, np.ndarray], ...]
    files: AssetFiles


def read(path: Path) -> Asset:
    """Read a URDF, or the only one in a folder; the asset's axes are those of the first link of the object.

    Meshes are looked up beside the file and, for ``package://``, in the asset's folder: the folder given, or the nearest
    one above the file that has a package.xml. Links behind joints that move are left out with a remark. Raises AssetError
    naming what is broken. Source: the URDF XML specification of ROS.
    """
    return asset_of(open_urdf(path), path)


def open_urdf(path: Path) -> UrdfTree:
    """Parse a URDF and choose the object in it; raises AssetError."""
    file = only_file(path) if path.is_dir() else path
    robot = parse_xml(file, "robot")
    files = AssetFiles(path if path.is_dir() else _package_of(file))
    files.used.add(file.resolve())
    return UrdfTree(file, robot, _rigid_links(file, robot, files), files)


def asset_of(tree: UrdfTree, path: Path, contact: Contact | None = None) -> Asset:
    """Return the asset that a URDF's elements describe; ``contact`` stands in for what they say of friction."""
    shapes = LinkShapes(tree.file, tree.robot, tree.files)
    visual = [part for link, pose in tree.links for part in shapes.visual(link, pose)]
    collision = [shape for link, pose in tree.links for shape in shapes.collision(link, pose)]
    if not visual and not collision and not tree.files.missing:
        raise AssetError(f"{tree.file.name}: no link of it has a shape")
    licence, attribution = stated_licence(comments_before(tree.robot))
    return Asset(
        format="urdf",
        path=path,
        name=tree.robot.get("name") or tree.file.stem,
        visual=tuple(visual),
        collision=tuple(collision),
        up="z",
        unit_m=1.0,
        inertial=declared_inertial(tree.file, tree.links),
        contact=contact or declared_contact(tree.file, tree.robot, [link for link, _ in tree.links], tree.files),
        license=licence,
        attribution=attribution,
        files=tree.files.sorted_files(),
        missing_files=tree.files.missing_names(),
        remarks=tuple(tree.files.remarks),
    )


def _package_of(file: Path) -> Path:
    folder = file.resolve().parent
    for above in (folder, *folder.parents):
        if (above / "package.xml").is_file():
            return above
    return folder


def _rigid_links(file: Path, robot: etree._Element, files: AssetFiles) -> tuple[tuple[etree._Element, np.ndarray], ...]:
    """Return the links of the first rigid group that has a shape, with their poses in the group's first link."""
    links = {link.get("name"): link for link in robot.findall("link")}
    if not links:
        raise AssetError(f"{file.name}: it has no <link>")
    children: dict[str, list[tuple[str, str, np.ndarray]]] = {name: [] for name in links}
    held: dict[str, str] = {}
    for joint in robot.findall("joint"):
        ends = [joint.find(tag) for tag in ("parent", "child")]
        parent, child = ("" if end is None else end.get("link", "") for end in ends)
        if parent not in links or child not in links or child in held:
            raise AssetError(
                f"{file.name}: joint {joint.get('name')!r} joins no two of its links, or a link that has a parent already"
            )
        kind = joint.get("type") or ""
        held[child] = f"{joint.get('name')} ({kind})"
        children[parent].append((child, kind, origin_of(joint, f"{file.name}: joint {joint.get('name')}")))
    groups: list[list[tuple[str, np.ndarray]]] = []
    heads = [name for name in links if name not in held]
    for head in heads:  # grows by the links behind joints that move
        group = [(head, np.eye(4))]
        for name, pose in group:
            for child, kind, child_to_parent in children[name]:
                if kind == "fixed":
                    group.append((child, pose @ child_to_parent))
                else:
                    heads.append(child)
        groups.append(group)
    if sum(len(group) for group in groups) < len(links):
        raise AssetError(f"{file.name}: its joints go in a circle")
    shaped = [group for group in groups if any(_has_shape(links[name]) for name, _ in group)]
    for group in shaped[1:]:
        joint_name = held.get(group[0][0])
        how = f"moves by joint {joint_name}" if joint_name else "is joined to nothing"
        files.remark(f"link {group[0][0]!r} {how} and was left out: one rigid object is read")
    chosen = shaped[0] if shaped else groups[0]
    return tuple((links[name], pose) for name, pose in chosen)


def _has_shape(link: etree._Element) -> bool:
    return link.find("visual") is not None or link.find("collision") is not None
