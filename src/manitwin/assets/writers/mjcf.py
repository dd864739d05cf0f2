"""MJCF: one body with a free joint that loads alone in MuJoCo and attaches to any scene.

Written after the XML reference of MuJoCo (mujoco.readthedocs.io, XMLreference). No compiler, option or default element: they
would act on the whole scene that the body is attached to.
"""

from __future__ import annotations

from pathlib import PurePosixPath

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.licenses import provenance_lines
from manitwin.assets.writers.mass_properties import PHYSICS_FILE, inertial_of, physics_file
from manitwin.assets.writers.mesh_files import VisualPart, hull_files, lost_maps, visual_parts
from manitwin.formats.xml_file import add, document, new_element, number_text
from manitwin.physics.mujoco.body import ROLLING_FRICTION_M, TORSIONAL_FRICTION_M

ASSETS = "assets"
VISUAL_GROUP, COLLISION_GROUP = "2", "3"  # as in MuJoCo Menagerie: the viewer shows 0 to 2 and hides 3
CONDIM = "4"  # with torsional friction, as in the package's own trials
MIN_VERTICES = 4  # MuJoCo's compiler: "at least 4 vertices required"


def export(twin: TwinContent) -> Exported:
    """Write a twin as MJCF with meshes beside it. Raises ExportError for mass properties that no rigid body has."""
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
            *lost_maps(twin),
            *([f"{left_out} visual parts of fewer than 4 vertices, which MuJoCo does not take."] if left_out else []),
        ),
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
        # an open sheet has no volume, and the mass is the body's own
        add(asset, "mesh", name=part.name, file=part.mesh, inertia="shell")
    for hull in hulls:
        add(asset, "mesh", name=PurePosixPath(hull).stem, file=hull, inertia="convex")


def _add_body(root: etree._Element, twin: TwinContent, parts: list[VisualPart], hulls: list[str]) -> None:
    inertial = inertial_of(twin)
    tensor = inertial.inertia_kg_m2
    body = add(add(root, "worldbody"), "body", name=twin.name)
    add(body, "freejoint", name=twin.name)
    add(
        body,
        "inertial",
        pos=number_text(*inertial.center_of_mass_m),
        mass=number_text(inertial.mass_kg),
        fullinertia=number_text(*(tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))),
    )
    for part in parts:
        add(
            body, "geom", name=part.name, type="mesh", mesh=part.name, material=part.name, group=VISUAL_GROUP,
            contype="0", conaffinity="0", mass="0",
        )  # fmt: skip
    friction = number_text(twin.physical.friction_static.value, TORSIONAL_FRICTION_M, ROLLING_FRICTION_M)
    for hull in (PurePosixPath(each).stem for each in hulls):
        add(
            body, "geom", name=hull, type="mesh", mesh=hull, group=COLLISION_GROUP,
            condim=CONDIM, friction=friction, mass="0",
        )  # fmt: skip
