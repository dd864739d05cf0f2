"""Friction in Drake's extension elements of collision shapes, in URDF and SDF."""

from __future__ import annotations

from collections.abc import Iterable

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset import Contact
from manitwin.assets.asset_files import AssetFiles
from manitwin.formats.xml_file import number

_STATIC, _DYNAMIC = "mu_static", "mu_dynamic"


def drake_contact(links: Iterable[etree._Element], files: AssetFiles, name: str) -> Contact | None:
    """Return the first friction that a collision of the links declares, with the range over all of them; None without any.

    If only one of the two coefficients is declared, it is used for both. Source: Drake, parsing of
    ``drake:proximity_properties`` (``drake:mu_static``, ``drake:mu_dynamic``), which have priority over other friction
    elements. ``name`` is the name of the file, for errors.
    """
    found: list[tuple[float, float]] = []
    for collision in (shape for link in links for shape in link.findall("collision")):
        said = {
            etree.QName(each).localname: number(
                each.get("value") or each.text, f"{name}: {etree.QName(each).localname}"
            )
            for each in collision.iterfind("{*}proximity_properties/{*}*")
            if etree.QName(each).localname in (_STATIC, _DYNAMIC)
        }
        if said:
            one = next(iter(said.values()))
            found.append((said.get(_STATIC, one), said.get(_DYNAMIC, one)))
    if not found:
        return None
    low, high = min(static for static, _ in found), max(static for static, _ in found)
    if low == high:
        return Contact(*found[0])
    files.remark(f"its collisions have frictions from {low:g} to {high:g}; a twin has one: the first, between these")
    return Contact(*found[0], friction_range=(low, high))
