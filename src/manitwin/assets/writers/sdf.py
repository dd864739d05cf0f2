"""SDFormat 1.9: a model folder as Gazebo's resource path takes it, with ``model.config``.

Written after the specification (sdformat.org/spec, version 1.9). Paths of meshes are relative to the file: ``model://`` would
need the resource path also where only the file is loaded.
"""

from __future__ import annotations

from pathlib import PurePosixPath

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.licenses import UNKNOWN, license_of, provenance_lines
from manitwin.assets.writers.mass_properties import PHYSICS_FILE, TwinInertial, inertial_of, physics_file
from manitwin.assets.writers.mesh_files import hull_files, lost_maps, visual_parts
from manitwin.formats.markdown import one_line
from manitwin.formats.xml_file import add, document, new_element, number_text

VERSION = "1.9"
MESHES = "meshes"
STILL = "0 0 0 0 0 0"
BOUNCE_THRESHOLD_M_S = 0.0  # the specification's default, 100 km/s, would keep restitution from ever acting
FRICTION = {"ode": ("mu", "mu2"), "bullet": ("friction", "friction2")}  # DART takes ODE's


def export(twin: TwinContent) -> Exported:
    """Write a twin as a Gazebo model. Raises ExportError for mass properties that no rigid body has."""
    parts, hulls = visual_parts(twin, MESHES), hull_files(twin, MESHES)
    root = new_element("sdf", version=VERSION)
    model = add(root, "model", name=twin.name)
    link = add(model, "link", name=twin.name)
    _add_inertial(link, inertial_of(twin))
    for part in parts:
        visual = _add_shape(link, "visual", part.mesh)
        if part.texture is None:
            material = add(visual, "material")
            for tag in ("ambient", "diffuse"):
                add(material, tag, number_text(*part.rgba))
    for hull in hulls:
        _add_surface(_add_shape(link, "collision", hull), twin)
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
            "how the friction of two bodies is combined: ODE and DART take the smaller of the two, Bullet the product.",
            "that a collision mesh is convex: the attribute for it came with SDFormat 1.11; every one here is.",
            *lost_maps(twin),
        ),
    )


def _add_inertial(link: etree._Element, inertial: TwinInertial) -> None:
    element = add(link, "inertial")
    add(element, "pose", f"{number_text(*inertial.center_of_mass_m)} 0 0 0")
    add(element, "mass", number_text(inertial.mass_kg))
    tensor = add(element, "inertia")
    for i in range(3):
        for j in range(i, 3):
            add(tensor, f"i{'xyz'[i]}{'xyz'[j]}", number_text(inertial.inertia_kg_m2[i, j]))


def _add_shape(link: etree._Element, tag: str, mesh: str) -> etree._Element:
    element = add(link, tag, name=PurePosixPath(mesh).stem)
    add(element, "pose", STILL)
    add(add(add(element, "geometry"), "mesh"), "uri", mesh)
    return element


def _add_surface(collision: etree._Element, twin: TwinContent) -> None:
    friction = twin.physical.friction_static.value
    surface = add(collision, "surface")
    engines = add(surface, "friction")
    for engine, tags in FRICTION.items():
        element = add(engines, engine)
        for tag in tags:
            add(element, tag, number_text(friction))
    bounce = add(surface, "bounce")
    add(bounce, "restitution_coefficient", number_text(twin.physical.restitution.value))
    add(bounce, "threshold", number_text(BOUNCE_THRESHOLD_M_S))


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
