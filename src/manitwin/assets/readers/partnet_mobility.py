"""Category of PartNet-Mobility objects, from the metadata beside their URDF.

Source: Xiang et al., SAPIEN: A SimulAted Part-based Interactive ENvironment, CVPR 2020, and the folders of its data set.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from manitwin.assets.asset import Asset
from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.importers.asset_name import split_words
from manitwin.errors import AssetError
from manitwin.formats.json_file import read_json_object

DESCRIPTION, METADATA = "mobility.urdf", "meta.json"
_CATEGORY = "model_cat"
_LONGEST = 60


def with_category(asset: Asset, file: Path, files: AssetFiles) -> Asset:
    """Return the asset of a URDF ``file`` with the category and name from ``meta.json`` beside a ``mobility.urdf``.

    The name in such a URDF is a digest. Other assets are returned unchanged, and those with a broken ``meta.json`` with a
    remark.
    """
    place = file.resolve().parent / METADATA
    if file.name != DESCRIPTION or not place.is_file() or not place.resolve().is_relative_to(files.root.resolve()):
        return asset
    try:
        said = read_json_object(place).get(_CATEGORY)
    except AssetError as error:
        return replace(asset, remarks=(*asset.remarks, str(error)))
    if not isinstance(said, str) or not said.strip():
        return asset
    category = " ".join(split_words(said).replace("_", " ").split()).lower()[:_LONGEST]
    return replace(asset, name=category, category=category, files=tuple(sorted({*asset.files, place.resolve()})))
