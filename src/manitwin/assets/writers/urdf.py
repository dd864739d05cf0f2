"""URDF export: one link, or the links and joints of an articulated twin, with mesh paths relative to the file.

Follows the URDF specification (wiki.ros.org/urdf/XML/link and /joint). ``<contact>`` is an extension of PyBullet (Bullet's
UrdfParser) that other loaders skip.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import PurePosixPath

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.licenses import provenance_lines
from manitwin.assets.writers.mass_properties import (
    PHYSICS_FILE,
    TwinInertial,
    inertial_of,
    inertial_of_link,
    physics_file,
)
from manitwin.assets.writers.mesh_files import VisualPart, hull_files, lost_texture_lines, visual_parts
from manitwin.formats.xml_file import add, document, new_element, number_text
from manitwin.geometry.articulation import ArticulatedJoint
from manitwin.robots.urdf import roll_pitch_yaw
from manitwin.twin.loaded_links import joints_of

MESHES = "meshes"
NO_EFFORT_LIMIT, NO_VELOCITY_LIMIT = 1e3, 1e2
"""Values for unknown limits, because the specification requires numbers: far beyond what a small object encounters."""


def export(twin: TwinContent) -> Exported:
    """Write a twin as URDF with meshes beside it. Raises ExportError for mass properties that are impossible for a rigid body."""
    parts, hulls = visual_parts(twin, MESHES), hull_files(twin, MESHES)
    root = new_element("robot", name=twin.name)
    if twin.record.links:
        _add_links(root, twin, parts, list(hulls))
    else:
        _add_link(root, twin, twin.name, inertial_of(twin), parts, hulls, np.zeros(3))
    files = {f"{twin.name}.urdf": document(root, provenance_lines(twin.record)), PHYSICS_FILE: physics_file(twin)}
    for part in parts:
        files |= part.files
    return Exported(
        files=files | hulls,
        main=f"{twin.name}.urdf",
        cannot_say=(
            f"friction and restitution: URDF has none. PyBullet reads `<contact>`; for others take them from {PHYSICS_FILE}.",
            "dynamic friction: PyBullet has one coefficient, given the static one, and multiplies those of two bodies.",
            "exact hulls: SAPIEN's loader drops corners within 0.7 mm of the hull of the others (PhysX's planeTolerance; "
            "`Twin.add_to_sapien` keeps them), PyBullet puts 1 mm around each hull (its collision margin).",
            *_missing_limit_lines(twin),
            *lost_texture_lines(twin),
        ),
        joints=True,
    )


def _missing_limit_lines(twin: TwinContent) -> list[str]:
    if all(None not in (joint.effort, joint.velocity) for joint in twin.record.joints):
        return []
    limits = f"{NO_EFFORT_LIMIT:g} and {NO_VELOCITY_LIMIT:g}"
    return [f"that nothing is known of effort or velocity limits: URDF asks for numbers, and {limits} stand for none."]


def _add_links(root: etree._Element, twin: TwinContent, parts: tuple[VisualPart, ...], hulls: list[str]) -> None:
    """Add every link in a frame at the joint to its parent, with the axes of the object frame."""
    record, joints = twin.record, joints_of(twin.record)
    origins = [np.zeros(3), *(joint.origin_m for joint in joints)]
    for place, link in enumerate(record.links):
        own = [part for part, of in zip(parts, twin.link_of_visual, strict=True) if of == place]
        felt = [hulls[number] for number in link.hulls]
        _add_link(root, twin, link.name, inertial_of_link(twin, link), own, felt, origins[place])
    for joint in joints:
        _add_joint(root, joint, record.links[joint.parent].name, record.links[joint.child].name, origins)


def _add_joint(
    root: etree._Element, joint: ArticulatedJoint, parent: str, child: str, origins: list[np.ndarray]
) -> None:
    """Add a joint; the pose of the child at position 0 follows from its motion away from the present position."""
    element = add(root, "joint", name=joint.name, type=joint.kind)
    at_zero = joint.motion(0.0)
    origin_m = at_zero[:3, :3] @ joint.origin_m + at_zero[:3, 3] - origins[joint.parent]
    angles = roll_pitch_yaw(at_zero[:3, :3])
    add(element, "parent", link=parent)
    add(element, "child", link=child)
    add(element, "origin", xyz=number_text(*origin_m), rpy=number_text(*angles))
    add(element, "axis", xyz=number_text(*joint.axis))
    limits = {
        "effort": number_text(NO_EFFORT_LIMIT if joint.effort is None else joint.effort),
        "velocity": number_text(NO_VELOCITY_LIMIT if joint.velocity is None else joint.velocity),
    }
    if joint.lower is not None and joint.upper is not None:
        limits = {"lower": number_text(joint.lower), "upper": number_text(joint.upper), **limits}
    if joint.kind != "prismatic" or joint.lower is not None:
        add(element, "limit", **limits)
    if joint.damping or joint.friction:
        add(element, "dynamics", damping=number_text(joint.damping), friction=number_text(joint.friction))


def _add_link(
    root: etree._Element,
    twin: TwinContent,
    name: str,
    inertial: TwinInertial,
    parts: Iterable[VisualPart],
    hulls: Iterable[str],
    origin_m: np.ndarray,
) -> None:
    """Add a link whose frame has its origin at ``origin_m`` in the object frame; its meshes are in the object frame."""
    link = add(root, "link", name=name)
    _add_inertial(link, inertial, origin_m)
    for part in parts:
        visual = _add_shape(link, "visual", part.mesh, origin_m)
        if part.texture is None:  # SAPIEN would prefer this material to the textured one of the mesh
            add(add(visual, "material", name=part.name), "color", rgba=number_text(*part.rgba))
    for hull in hulls:
        _add_shape(link, "collision", hull, origin_m)
    contact = add(link, "contact")
    add(contact, "lateral_friction", value=number_text(twin.physical.friction_static.value))
    add(contact, "restitution", value=number_text(twin.physical.restitution.value))


def _add_inertial(link: etree._Element, inertial: TwinInertial, origin_m: np.ndarray) -> None:
    tensor = inertial.inertia_kg_m2
    element = add(link, "inertial")
    add(element, "origin", xyz=number_text(*(inertial.center_of_mass_m - origin_m)), rpy="0 0 0")
    add(element, "mass", value=number_text(inertial.mass_kg))
    moments = {f"i{'xyz'[i]}{'xyz'[j]}": number_text(tensor[i, j]) for i in range(3) for j in range(i, 3)}
    add(element, "inertia", **moments)


def _add_shape(link: etree._Element, tag: str, mesh: str, origin_m: np.ndarray) -> etree._Element:
    element = add(link, tag, name=PurePosixPath(mesh).stem)
    add(element, "origin", xyz=number_text(*-origin_m) if origin_m.any() else "0 0 0", rpy="0 0 0")
    add(add(element, "geometry"), "mesh", filename=mesh)
    return element
