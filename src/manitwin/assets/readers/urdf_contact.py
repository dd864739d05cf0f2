"""Friction in URDF, which the format itself does not have: PyBullet's element and Gazebo's."""

from __future__ import annotations

from pathlib import Path

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset import Contact
from manitwin.assets.asset_files import AssetFiles
from manitwin.formats.xml_file import number


def declared_contact(file: Path, robot: etree._Element, links: list[etree._Element], files: AssetFiles) -> Contact:
    """Return the first of PyBullet's <contact>, a <gazebo> in a collision, and a <gazebo reference>.

    PyBullet's lateral_friction is the one coefficient of a body, sticking or sliding. Gazebo's mu1 and mu2 are two
    directions of one coefficient (SDF specification, friction/ode): the first is taken, with a remark where they differ.
    """
    for link in links:
        contact = link.find("contact")
        if contact is not None:
            friction = _value(file, contact.find("lateral_friction"))
            return Contact(friction, friction, _value(file, contact.find("restitution")))
    gazebo = gazebo_friction(file, robot, links)
    if gazebo is None:
        return Contact()
    first, second = gazebo
    if second is not None and second != first:
        files.remark(f"mu1 {first} and mu2 {second} are two directions in Gazebo; the first was taken")
    return Contact(first, None)


def gazebo_friction(
    file: Path, robot: etree._Element, links: list[etree._Element]
) -> tuple[float, float | None] | None:
    """Return mu1 and mu2 of the first <gazebo> of the links that has mu1, None where none has."""
    names = {link.get("name") for link in links}
    inside = [element for link in links for element in link.iter("gazebo")]
    beside = [element for element in robot.findall("gazebo") if element.get("reference") in names]
    for element in [*inside, *beside]:
        first = element.find("mu1")
        if first is not None:
            second = element.find("mu2")
            return (
                number(first.text, f"{file.name}: mu1"),
                None if second is None else number(second.text, f"{file.name}: mu2"),
            )
    return None


def _value(file: Path, element: etree._Element | None) -> float | None:
    return None if element is None else number(element.get("value"), f"{file.name}: {element.tag}")
