"""What the links of a URDF declare of mass, taken together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset import Inertial
from manitwin.errors import AssetError
from manitwin.formats.xml_file import number, origin_of

_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def declared_inertial(file: Path, links: tuple[tuple[etree._Element, np.ndarray], ...]) -> Inertial:
    """Return the mass, the centre of mass and the inertia about it of links with their poses, as declared.

    Links without <inertial> count nothing; the inertia is None where one with a mass gives none. The inertial's origin is
    the link's where it is left out (URDF specification), and the tensor is along that origin's axes.
    """
    found = [_of_link(file, link, pose) for link, pose in links if link.find("inertial") is not None]
    with_mass = [entry for entry in found if entry.mass_kg is not None]
    if not with_mass:
        return found[0] if found else Inertial()
    return combined(with_mass)


def combined(bodies: list[Inertial]) -> Inertial:
    """Return rigidly joined bodies, all with mass and centre, as one (the parallel axis theorem)."""
    if len(bodies) == 1:
        return bodies[0]
    masses = np.array([body.mass_kg for body in bodies], float)
    total = float(masses.sum())
    centers = [body.center_of_mass_m for body in bodies]
    if total == 0 or any(center is None for center in centers):
        return Inertial(total)
    points = np.array(centers, float)
    center = masses @ points / total
    if any(body.inertia_kg_m2 is None for body in bodies):
        return Inertial(total, center)
    offsets = points - center
    moved = [
        np.asarray(body.inertia_kg_m2) + mass * ((offset @ offset) * np.eye(3) - np.outer(offset, offset))
        for body, mass, offset in zip(bodies, masses, offsets, strict=True)
    ]
    return Inertial(total, center, np.sum(moved, axis=0))


def _of_link(file: Path, link: etree._Element, link_to_asset: np.ndarray) -> Inertial:
    name = f"{file.name}: link {link.get('name')}"
    inertial = link.find("inertial")
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    inertial_to_asset = link_to_asset @ origin_of(inertial, f"{name} inertial")
    mass_kg = None if mass is None else number(mass.get("value"), f"{name} mass")
    tensor = None
    if inertia is not None:
        if any(inertia.get(key) is None for key in ("ixx", "iyy", "izz")):
            raise AssetError(f"{name}: its inertia lacks one of ixx, iyy, izz")
        xx, xy, xz, yy, yz, zz = (number(inertia.get(key, "0"), f"{name} {key}") for key in _MOMENTS)
        rotation = inertial_to_asset[:3, :3]
        tensor = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
    return Inertial(mass_kg, inertial_to_asset[:3, 3], tensor)
