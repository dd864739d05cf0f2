"""The friction that Drake's elements of collision shapes say, in URDF and SDF."""

from __future__ import annotations

from collections.abc import Iterable

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset import Contact
from manitwin.assets.asset_files import AssetFiles
from manitwin.formats.xml_file import number

_STATIC, _DYNAMIC = "mu_static", "mu_dynamic"


def drake_contact(links: Iterable[etree._Element], files: AssetFiles, name: str) -> Contact | None:
    """Return the friction of the first collision of links that says any, with the range of all; None where none does.

    One of the two alone is both. Source: Drake, parsing of ``drake:proximity_properties`` (``drake:mu_static``,
    ``drake:mu_dynamic``), which go before what else a file says. ``name`` is the file's, for errors.
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
