"""URDF: one link, with paths relative to the file.

Written after the URDF specification (wiki.ros.org/urdf/XML/link); ``<contact>`` is an element of PyBullet (Bullet's
UrdfParser), which others skip.
"""

from __future__ import annotations

from pathlib import PurePosixPath

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.licenses import provenance_lines
from manitwin.assets.writers.mass_properties import PHYSICS_FILE, TwinInertial, inertial_of, physics_file
from manitwin.assets.writers.mesh_files import hull_files, lost_maps, visual_parts
from manitwin.formats.xml_file import add, document, new_element, number_text

MESHES = "meshes"


def export(twin: TwinContent) -> Exported:
    """Write a twin as URDF with meshes beside it. Raises ExportError for mass properties that no rigid body has."""
    parts, hulls = visual_parts(twin, MESHES), hull_files(twin, MESHES)
    root = new_element("robot", name=twin.name)
    link = add(root, "link", name=twin.name)
    _add_inertial(link, inertial_of(twin))
    for part in parts:
        visual = _add_shape(link, "visual", part.mesh)
        if (
            part.texture is None
        ):  # where there is a texture in the mesh's own material, SAPIEN would drop it for this one
            add(add(visual, "material", name=part.name), "color", rgba=number_text(*part.rgba))
    for hull in hulls:
        _add_shape(link, "collision", hull)
    contact = add(link, "contact")
    add(contact, "lateral_friction", value=number_text(twin.physical.friction_static.value))
    add(contact, "restitution", value=number_text(twin.physical.restitution.value))
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
            *lost_maps(twin),
        ),
    )


def _add_inertial(link: etree._Element, inertial: TwinInertial) -> None:
    tensor = inertial.inertia_kg_m2
    element = add(link, "inertial")
    add(element, "origin", xyz=number_text(*inertial.center_of_mass_m), rpy="0 0 0")
    add(element, "mass", value=number_text(inertial.mass_kg))
    moments = {f"i{'xyz'[i]}{'xyz'[j]}": number_text(tensor[i, j]) for i in range(3) for j in range(i, 3)}
    add(element, "inertia", **moments)


def _add_shape(link: etree._Element, tag: str, mesh: str) -> etree._Element:
    element = add(link, tag, name=PurePosixPath(mesh).stem)
    add(element, "origin", xyz="0 0 0", rpy="0 0 0")
    add(add(element, "geometry"), "mesh", filename=mesh)
    return element
