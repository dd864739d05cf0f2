"""Licence of the ROS package that contains an asset, for assets that state none themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from manitwin.assets.licence_text import short_licence, stated_or_none
from manitwin.assets.root import upward
from manitwin.errors import AssetError
from manitwin.formats.xml_file import read_xml, text_of

if TYPE_CHECKING:
    from manitwin.assets.asset import Asset

PACKAGE = "package.xml"


def with_package_licence(asset: Asset, root: Path, *, say: bool) -> Asset:
    """Return an asset with the licence and authors of the nearest package up to ``root``, if it states no licence itself.

    Several licences of a package are joined by ``AND``, because all apply to its content. With ``say``, a remark names the
    package; bulk measurements leave it out.

    Source: REP 149, package manifest format three.
    """
    if stated_or_none(asset.license) is not None:
        return asset
    own = asset.path if asset.path.is_dir() else asset.path.parent
    file = next((folder / PACKAGE for folder in upward(own, root) if (folder / PACKAGE).is_file()), None)
    if file is None or not file.resolve().is_relative_to(root.resolve()):
        return asset
    try:
        package = read_xml(file, "package")
    except AssetError as error:
        return replace(asset, remarks=(*asset.remarks, f"{error}; its licence was not read"))
    said = (stated_or_none(" ".join((each.text or "").split())) for each in package.findall("license"))
    licences = [short_licence(each) for each in said if each is not None and not each.lower().startswith("todo")]
    if not licences:
        return asset
    authors = [name for each in package.findall("author") if (name := " ".join((each.text or "").split()))]
    licence = " AND ".join(dict.fromkeys(licences))
    name = text_of(package, "name") or file.parent.name
    remark = f"the licence {licence[:80]} is that of the package {name[:80]} ({PACKAGE}); the asset does not state one"
    return replace(
        asset,
        license=licence,
        attribution=asset.attribution or ", ".join(authors) or None,
        files=tuple(sorted({*asset.files, file.resolve()})),
        remarks=(*asset.remarks, remark) if say and asset.visual else asset.remarks,
    )
