"""SDFormat 1.9 export: a model folder for Gazebo's resource path, with ``model.config``, including the links and joints of a
twin.

Follows the specification (sdformat.org/spec, version 1.9). Mesh paths are relative to the file, because ``model://`` would
require the resource path even for loading the file alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import PurePosixPath

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.licenses import UNKNOWN, license_of, provenance_lines
from manitwin.assets.writers.mass_properties import (
    PHYSICS_FILE,
    TwinInertial,
    inertial_of,
    inertial_of_link,
    physics_file,
)
from manitwin.assets.writers.mesh_files import VisualPart, hull_files, lost_texture_lines, visual_parts
from manitwin.formats.markdown import one_line
from manitwin.formats.xml_file import add, document, new_element, number_text
from manitwin.geometry.articulation import ArticulatedJoint
from manitwin.robots.urdf import roll_pitch_yaw
from manitwin.twin.loaded_links import joints_of

VERSION = "1.9"
MESHES = "meshes"
STILL = "0 0 0 0 0 0"
BOUNCE_THRESHOLD_M_S = 0.0  # the specification's default of 100 km/s would disable restitution altogether
CANNOT_SAY = (
    "how the friction of two bodies is combined: ODE and DART take the smaller of the two, Bullet the product.",
    "that a collision mesh is convex: the attribute for it came with SDFormat 1.11; every one here is.",
)
FRICTION = {"ode": ("mu", "mu2"), "bullet": ("friction", "friction2")}  # DART reads ODE's


def export(twin: TwinContent) -> Exported:
    """Write a twin as a Gazebo model. Raises ExportError for mass properties that are impossible for a rigid body."""
    parts, hulls = visual_parts(twin, MESHES), hull_files(twin, MESHES)
    root = new_element("sdf", version=VERSION)
    model = add(root, "model", name=twin.name)
    if twin.record.links:
        _add_links(model, twin, parts, list(hulls))
    else:
        add_body(model, twin, parts, hulls)
    files = {
        "model.sdf": document(root, provenance_lines(twin.record)),
        "model.config": _model_config(twin),
        PHYSICS_FILE: physics_file(twin),
    }
    for part in parts:
        files |= part.files
    return Exported(
        files={f"{twin.name}/{name}": data for name, data in (files | hulls).items()},
        main=f"{twin.name}/model.sdf",
        cannot_say=(
            f"dynamic friction: mu and mu2 are the static coefficient in two directions; {PHYSICS_FILE} has both.",
            *CANNOT_SAY,
            *_renamed(twin),
            *lost_texture_lines(twin),
        ),
        joints=True,
    )


def add_body(model: etree._Element, twin: TwinContent, parts: Iterable[VisualPart], hulls: Iterable[str]) -> None:
    """Add a twin as one rigid body to a model, with the meshes ``parts`` and ``hulls``; raises ExportError like ``export``."""
    link = add(model, "link", name=twin.name)
    _fill_link(link, twin, inertial_of(twin), parts, hulls, np.zeros(3))


def _add_links(model: etree._Element, twin: TwinContent, parts: tuple[VisualPart, ...], hulls: list[str]) -> None:
    """Add every link in a frame at the joint to its parent, with the axes of the object frame.

    The pose of a link is relative to its parent link, with all joints at position 0.
    """
    record, joints = twin.record, joints_of(twin.record)
    origins = [np.zeros(3), *(joint.origin_m for joint in joints)]
    for place, said in enumerate(record.links):
        link = add(model, "link", name=said.name)
        if place > 0:
            joint = joints[place - 1]
            _add_pose_at_zero(link, joint, record.links[joint.parent].name, origins[joint.parent])
        own = [part for part, of in zip(parts, twin.link_of_visual, strict=True) if of == place]
        felt = [hulls[number] for number in said.hulls]
        _fill_link(link, twin, inertial_of_link(twin, said), own, felt, origins[place])
    for joint, name in zip(joints, joint_names(twin), strict=True):
        _add_joint(model, joint, name, record.links[joint.parent].name, record.links[joint.child].name)


def _add_pose_at_zero(link: etree._Element, joint: ArticulatedJoint, parent: str, parent_origin_m: np.ndarray) -> None:
    at_zero = joint.motion(0.0)
    origin_m = at_zero[:3, :3] @ joint.origin_m + at_zero[:3, 3] - parent_origin_m
    pose = add(link, "pose", number_text(*origin_m, *roll_pitch_yaw(at_zero[:3, :3])))
    pose.set("relative_to", parent)


def _renamed(twin: TwinContent) -> list[str]:
    pairs = zip(twin.record.joints, joint_names(twin), strict=True)
    changed = [f"{joint.name} is {name}" for joint, name in pairs if name != joint.name]
    return [f"joints called as links are: {', '.join(changed)}."] if changed else []


def joint_names(twin: TwinContent) -> list[str]:
    """Return the joint names; ``_joint`` is appended to a name that a link has too, since SDFormat has one scope for both."""
    links = {link.name for link in twin.record.links}
    taken, names = links | {joint.name for joint in twin.record.joints}, []
    for joint in twin.record.joints:
        name = joint.name
        while name in links or (name != joint.name and name in taken):
            name += "_joint"
        taken.add(name)
        names.append(name)
    return names


def _add_joint(model: etree._Element, joint: ArticulatedJoint, name: str, parent: str, child: str) -> None:
    """Add a joint in the frame of its child, which is the default for a joint without a pose."""
    element = add(model, "joint", name=name, type=joint.kind)
    add(element, "parent", parent)
    add(element, "child", child)
    axis = add(element, "axis")
    add(axis, "xyz", number_text(*joint.axis))
    said = {"lower": joint.lower, "upper": joint.upper, "effort": joint.effort, "velocity": joint.velocity}
    limits = {name: value for name, value in said.items() if value is not None}
    if limits:
        limit = add(axis, "limit")
        for name, value in limits.items():
            add(limit, name, number_text(value))
    if joint.damping or joint.friction:
        dynamics = add(axis, "dynamics")
        add(dynamics, "damping", number_text(joint.damping))
        add(dynamics, "friction", number_text(joint.friction))


def _fill_link(
    link: etree._Element,
    twin: TwinContent,
    inertial: TwinInertial,
    parts: Iterable[VisualPart],
    hulls: Iterable[str],
    origin_m: np.ndarray,
) -> None:
    """Fill a link whose frame has its origin at ``origin_m`` in the object frame; its meshes are in the object frame."""
    _add_inertial(link, inertial, origin_m)
    for part in parts:
        visual = _add_shape(link, "visual", part.mesh, origin_m)
        if part.texture is None:
            material = add(visual, "material")
            for tag in ("ambient", "diffuse"):
                add(material, tag, number_text(*part.rgba))
    for hull in hulls:
        _add_surface(_add_shape(link, "collision", hull, origin_m), twin)


def _add_inertial(link: etree._Element, inertial: TwinInertial, origin_m: np.ndarray) -> None:
    element = add(link, "inertial")
    add(element, "pose", f"{number_text(*(inertial.center_of_mass_m - origin_m))} 0 0 0")
    add(element, "mass", number_text(inertial.mass_kg))
    tensor = add(element, "inertia")
    for i in range(3):
        for j in range(i, 3):
            add(tensor, f"i{'xyz'[i]}{'xyz'[j]}", number_text(inertial.inertia_kg_m2[i, j]))


def _add_shape(link: etree._Element, tag: str, mesh: str, origin_m: np.ndarray) -> etree._Element:
    element = add(link, tag, name=PurePosixPath(mesh).stem)
    add(element, "pose", f"{number_text(*-origin_m)} 0 0 0" if origin_m.any() else STILL)
    add(add(add(element, "geometry"), "mesh"), "uri", mesh)
    return element


def _add_surface(collision: etree._Element, twin: TwinContent) -> None:
    friction = twin.physical.friction_static.value
    surface = add_friction(collision, friction)
    bounce = add(surface, "bounce")
    add(bounce, "restitution_coefficient", number_text(twin.physical.restitution.value))
    add(bounce, "threshold", number_text(BOUNCE_THRESHOLD_M_S))


def add_friction(collision: etree._Element, friction: float) -> etree._Element:
    """Add a surface with one coefficient of friction, for ODE, DART and Bullet, to a collision, and return the surface."""
    surface = add(collision, "surface")
    engines = add(surface, "friction")
    for engine, tags in FRICTION.items():
        element = add(engines, engine)
        for tag in tags:
            add(element, tag, number_text(friction))
    return surface


def _model_config(twin: TwinContent) -> bytes:
    record = twin.record
    words = record.language.caption if record.language is not None else record.name or twin.name
    root = new_element("model")
    add(root, "name", twin.name)
    add(root, "version", "1.0")
    add(root, "sdf", "model.sdf", version=VERSION)
    author = add(root, "author")
    add(author, "name", one_line(record.source.attribution or "") or UNKNOWN)
    add(root, "license", license_of(record))
    add(root, "description", one_line(words))
    return document(root, provenance_lines(record))
