"""Reader of EmbodiedGen assets: a URDF with the answers of its annotator in <extra_info> and <custom_data>."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset import Asset, Contact
from manitwin.assets.asset_files import MESH_LIMITS
from manitwin.assets.readers.urdf import UrdfObject, asset_of, gazebo_friction, open_urdf
from manitwin.formats.meshes.source import MeshLimits
from manitwin.formats.xml_file import number, text_of
from manitwin.robots.urdf import origin_of

_RANGES = (("mass", "kg"), ("height", "m"))
_FAILED = (1.0, 1.0, 1.0, 1.0)  # what URDFGenerator writes for mass and height if its model did not answer
_UNSAID = ("unknown", "-1", "")
_HEIGHT_OFF = 0.05  # relative to the declared height: a tilted or wrongly scaled mesh deviates by more


def read(path: Path, root: Path | None = None, limits: MeshLimits = MESH_LIMITS) -> Asset:
    """Read EmbodiedGen's URDF, or the one in a folder (result/NAME.urdf); raises AssetError like the URDF reader.

    mu1 and mu2 are the static and dynamic friction that its annotator was asked for. If the visual's origin has no rotation
    (older versions), the Y axis of the mesh is up. Source: embodied_gen/validators/urdf_convertor.py of
    HorizonRobotics/EmbodiedGen.
    """
    found = open_urdf(path, root, limits)
    asset = asset_of(found, path, contact=_contact(found))
    info = found.tree.element.find(".//extra_info")
    remarks = list(asset.remarks)
    up = asset.up
    if not _is_turned(found):
        up = "y"
        remarks.append("its mesh is not turned upright, as older versions leave it: the Y axis is up")
    remarks += _quality(found.tree.element)
    category: str | None = None
    captions: tuple[str, ...] = ()
    if info is not None:
        category = _stated_text(text_of(info, "category"))
        description = _stated_text(text_of(info, "description"))
        captions = () if description is None else (description,)
        remarks += _ranges(found, info)
        remarks += _height(found, info, asset, "yz".index(up) + 1)
    return replace(asset, format="embodiedgen", up=up, category=category, captions=captions, remarks=tuple(remarks))


def _contact(found: UrdfObject) -> Contact:
    gazebo = gazebo_friction(found)
    return Contact() if gazebo is None else Contact(gazebo[0], gazebo[1])


def _is_turned(found: UrdfObject) -> bool:
    visuals = [visual for link, _ in found.links for visual in link.findall("visual")]
    return any(not np.allclose(origin_of(visual)[:3, :3], np.eye(3)) for visual in visuals)


def _ranges(found: UrdfObject, info: etree._Element) -> list[str]:
    """Return remarks with the annotator's intervals; a failed answer leaves one metre and one kilogram."""
    remarks, values = [], []
    for quantity, unit in _RANGES:
        low, high = (info.find(f"{bound}_{quantity}") for bound in ("min", "max"))
        if low is not None and high is not None:
            pair = [number(text_of(e, "."), f"{found.file.name}: {e.tag}") for e in (low, high)]
            values += pair
            remarks.append(f"its annotator said {quantity} {pair[0]:g} to {pair[1]:g} {unit}")
    if tuple(values) == _FAILED:
        remarks.append("mass and height of exactly 1 are what EmbodiedGen writes where its annotator did not answer")
    return remarks


def _height(found: UrdfObject, info: etree._Element, asset: Asset, axis: int) -> list[str]:
    element = info.find("real_height")
    if element is None or not asset.visual:
        return []
    said = number(text_of(element, "."), f"{found.file.name}: real_height")
    points = np.concatenate([part.vertices for part in asset.visual])
    height_m = float(np.ptp(points[:, axis]))
    if said > 0 and abs(height_m / said - 1) > _HEIGHT_OFF:
        return [f"the mesh is {height_m:.4g} m high, and real_height says {said:.4g} m"]
    return []


def _quality(robot: etree._Element) -> list[str]:
    quality = robot.find(".//custom_data/quality")
    if quality is None:
        return []
    return [f"its {tag.tag} said {(text_of(tag, '.') or 'nothing')[:120]}" for tag in quality.iterchildren(tag="*")]


def _stated_text(text: str | None) -> str | None:
    return None if text is None or text.lower() in _UNSAID else text
