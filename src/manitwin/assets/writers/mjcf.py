"""MJCF export: a body with a free joint, and its links below it, that loads alone in MuJoCo and can be attached to any scene.

Follows MuJoCo's XML reference (mujoco.readthedocs.io, XMLreference). The file has no compiler, option or default element,
because these would affect the whole scene that the body is attached to.
"""

from __future__ import annotations

import math
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
from manitwin.physics.mujoco.body import ROLLING_FRICTION_M, TORSIONAL_FRICTION_M
from manitwin.twin.loaded_links import joints_of

ASSETS = "assets"
VISUAL_GROUP, COLLISION_GROUP = "2", "3"  # as in MuJoCo Menagerie: the viewer shows 0 to 2 and hides 3
CONDIM = "4"  # with torsional friction, as in the package's own trials
MIN_VERTICES = 4  # MuJoCo's compiler: "at least 4 vertices required"


def export(twin: TwinContent) -> Exported:
    """Write a twin as MJCF with meshes beside it. Raises ExportError for mass properties that are impossible for a rigid body."""
    parts = visual_parts(twin, ASSETS)
    kept = [part for part in parts if part.places >= MIN_VERTICES]
    hulls = hull_files(twin, ASSETS)
    root = new_element("mujoco", model=twin.name)
    _add_assets(root, kept, list(hulls))
    _add_body(root, twin, kept, list(hulls))
    files = {f"{twin.name}.xml": document(root, provenance_lines(twin.record)), PHYSICS_FILE: physics_file(twin)}
    for part in kept:
        files |= part.files
    left_out = len(parts) - len(kept)
    return Exported(
        files=files | hulls,
        main=f"{twin.name}.xml",
        cannot_say=(
            f"dynamic friction and restitution: MuJoCo has one coefficient and a soft contact; {PHYSICS_FILE} has both.",
            "how the friction of two bodies is combined: MuJoCo takes the larger of the two.",
            *lost_texture_lines(twin),
            *([f"{left_out} visual parts of fewer than 4 vertices, which MuJoCo does not take."] if left_out else []),
            *(
                ["effort and velocity limits of joints: MuJoCo has them for motors alone."]
                if twin.record.joints
                else []
            ),
        ),
        joints=True,
    )


def _add_assets(root: etree._Element, parts: list[VisualPart], hulls: list[str]) -> None:
    asset = add(root, "asset")
    for part in parts:
        material = {
            "rgba": number_text(*part.rgba),
            "metallic": number_text(part.metallic),
            "roughness": number_text(part.roughness),
        }
        if part.texture is not None:
            add(asset, "texture", type="2d", name=part.name, file=part.texture)
            material["texture"] = part.name
        add(asset, "material", name=part.name, **material)
        # an open sheet has no volume, and the body states the mass
        add(asset, "mesh", name=part.name, file=part.mesh, inertia="shell")
    for hull in hulls:
        add(asset, "mesh", name=PurePosixPath(hull).stem, file=hull, inertia="convex")


def _add_body(root: etree._Element, twin: TwinContent, parts: list[VisualPart], hulls: list[str]) -> None:
    """Add the body of the twin, or the bodies of its links, each below the body of its parent link."""
    body = add(add(root, "worldbody"), "body", name=twin.name)
    add(body, "freejoint", name=twin.name)
    if not twin.record.links:
        _fill_body(body, twin, inertial_of(twin), parts, hulls, np.zeros(3))
        return
    joints = joints_of(twin.record)
    origins = [np.zeros(3), *(joint.origin_m for joint in joints)]
    bodies = [body]
    link_of = dict(zip((part.name for part in visual_parts(twin, ASSETS)), twin.link_of_visual, strict=True))
    for place, link in enumerate(twin.record.links):
        if place:
            joint = joints[place - 1]
            at = joint.origin_m - origins[joint.parent]
            bodies.append(add(bodies[joint.parent], "body", name=link.name, pos=number_text(*at)))
            _add_joint(bodies[place], joint)
        own = [part for part in parts if link_of[part.name] == place]
        felt = [hulls[number] for number in link.hulls]
        _fill_body(bodies[place], twin, inertial_of_link(twin, link), own, felt, origins[place])


def _add_joint(body: etree._Element, joint: ArticulatedJoint) -> None:
    """Add a joint at the origin of its body; MJCF angles are in degrees by default."""
    unit = 1.0 if joint.kind == "prismatic" else math.degrees(1.0)
    said = {"type": "slide" if joint.kind == "prismatic" else "hinge", "axis": number_text(*joint.axis)}
    if joint.lower is not None and joint.upper is not None:
        said |= {"limited": "true", "range": number_text(unit * joint.lower, unit * joint.upper)}
    else:
        said["limited"] = "false"
    for key, value in (("ref", unit * joint.stands_at), ("damping", joint.damping), ("frictionloss", joint.friction)):
        if value:
            said[key] = number_text(value)
    add(body, "joint", name=joint.name, **said)


def _fill_body(
    body: etree._Element,
    twin: TwinContent,
    inertial: TwinInertial,
    parts: Iterable[VisualPart],
    hulls: Iterable[str],
    origin_m: np.ndarray,
) -> None:
    """Add mass properties and meshes to a body whose frame has its origin at ``origin_m`` in the object frame."""
    tensor = inertial.inertia_kg_m2
    add(
        body,
        "inertial",
        pos=number_text(*(inertial.center_of_mass_m - origin_m)),
        mass=number_text(inertial.mass_kg),
        fullinertia=number_text(*(tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))),
    )
    at = {"pos": number_text(*-origin_m)} if origin_m.any() else {}
    for part in parts:
        add(
            body, "geom", name=part.name, type="mesh", mesh=part.name, material=part.name, group=VISUAL_GROUP,
            contype="0", conaffinity="0", mass="0", **at,
        )  # fmt: skip
    friction = number_text(twin.physical.friction_static.value, TORSIONAL_FRICTION_M, ROLLING_FRICTION_M)
    for hull in (PurePosixPath(each).stem for each in hulls):
        add(
            body, "geom", name=hull, type="mesh", mesh=hull, group=COLLISION_GROUP,
            condim=CONDIM, friction=friction, mass="0", **at,
        )  # fmt: skip
