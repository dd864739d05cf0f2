"""Removal of MJCF content that does not describe rigid objects, with remarks where an object loses something."""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.readers.mjcf_dialects import rewrite_dialects
from manitwin.errors import AssetError
from manitwin.formats.xml_file import MAX_NUMBER

_SECTIONS = frozenset({"compiler", "default", "asset", "worldbody"})
ACTING = frozenset({"equality", "tendon", "actuator"})
"""Sections that act on joints and are not read."""
_ASSETS = frozenset({"mesh", "material", "texture", "hfield", "model"})
_UNSEEN = ("light", "camera")
_COMPOSITE, _FLEX = "composite", "flexcomp"
_CODE = "plugin"
COMPUTED = "shapes that a plug-in computes were left out: it is code, and none is run"
_WORDS = frozenset(
    {"name", "file", "mesh", "material", "texture", "class", "childclass", "model", "user", "prefix", "body", "frame"}
)
_OF_SHAPE_AND_MASS = frozenset(
    {"pos", "size", "scale", "fromto", "vertex", "refpos", "mass", "density", "diaginertia", "fullinertia", "friction"}
)
"""Attributes whose numbers an object limits; stiffnesses and limits may have any size."""
_MAX_ELEMENTS = 100_000


def keep_rigid_objects(
    file: Path, root: etree._Element, files: AssetFiles, sizes: dict[str, float], *, keep_soft: bool = False
) -> bool:
    """Remove everything from a parsed MJCF that does not belong to rigid objects; return whether it had soft bodies.

    Composites and flexes (only the former with ``keep_soft``) are soft, and plug-ins are code; neither is read. ``replicate``
    and ``attach`` stay for MuJoCo to expand. ``sizes``: the number of elements of each attached model. Raises AssetError for a
    file that is too large or has numbers that are impossible for an object.
    """
    if expanded_size(root, sizes) > _MAX_ELEMENTS:
        raise AssetError(f"{file.name}: more than {_MAX_ELEMENTS} elements; it is no single object")
    soft = root.find(f".//{_FLEX}") is not None
    for tag in (_COMPOSITE,) if keep_soft else (_COMPOSITE, _FLEX):
        for element in list(root.iter(tag)):
            element.getparent().remove(element)
            files.remark(_left_out_remark(tag))
    for element in list(root.iter(*_UNSEEN)):
        element.getparent().remove(element)
    for section in list(root):
        if section.tag not in _SECTIONS:
            root.remove(section)
    _leave_out_plugins(root, files)
    for entry in root.xpath("asset/*"):
        if entry.tag not in _ASSETS:
            entry.getparent().remove(entry)
    for element in root.iter(etree.Element):
        _check_numbers(file, element)
    _check_made_surfaces(file, root, files)
    rewrite_dialects(root, files)
    return soft


def _left_out_remark(tag: str) -> str:
    return f"<{tag}> is no rigid body and was left out"


LEFT_OUT_COMPOSITE = _left_out_remark(_COMPOSITE)


def expanded_size(element: etree._Element, sizes: dict[str, float]) -> float:
    """Return the number of elements after expanding every <replicate> and <attach>, given the ``sizes`` of models.

    An <attach> of the document itself adds at most all elements counted so far.
    """
    count = 0.0
    weights: dict[etree._Element, float] = {}
    for each in element.iter(etree.Element):
        weight = weights.get(each.getparent(), 1.0)
        if each.tag == "replicate":
            with suppress(ValueError):  # MuJoCo reports the error
                weight *= max(1.0, float(each.get("count", "1")))
        weights[each] = weight
        count += weight
        if each.tag == "attach":
            count += weight * (count if each.get("model") is None else sizes.get(each.get("model"), 0.0))
    return count


def _leave_out_plugins(root: etree._Element, files: AssetFiles) -> None:
    """Remove plug-ins, and the meshes and geoms whose shape a plug-in computes."""
    computed = set()
    for plugin in list(root.iter(_CODE)):
        holder = plugin.getparent()
        holder.remove(plugin)
        if holder.tag == "mesh":
            computed.add(holder.get("name"))
            holder.getparent().remove(holder)
        elif holder.tag == "geom" and holder.get("type") == "sdf":
            holder.getparent().remove(holder)
        else:  # it adds a force, for example
            continue
        files.remark(COMPUTED)
    for geom in [geom for geom in root.iter("geom") if geom.get("mesh") in computed and computed]:
        geom.getparent().remove(geom)


def _check_numbers(file: Path, element: etree._Element) -> None:
    for name, text in element.attrib.items():
        if name in _WORDS:
            continue
        for word in text.split():
            try:
                value = float(word)
            except ValueError:
                break
            bounded = name in _OF_SHAPE_AND_MASS
            if math.isnan(value) or (bounded and abs(value) > MAX_NUMBER):
                raise AssetError(f"{file.name}: <{element.tag} {name}> is {value}, no number that an object can have")


def _check_made_surfaces(file: Path, root: etree._Element, files: AssetFiles) -> None:
    """Raise AssetError for a height field or built-in mesh with too many points, before MuJoCo allocates them.

    The first parameter of a supersphere and a supertorus is a resolution in both directions (MJCF, mesh/params).
    """
    sizes = [("height field", f"{field.get('nrow', '')} {field.get('ncol', '')}") for field in root.iter("hfield")]
    for mesh in root.iter("mesh"):
        params, squared = mesh.get("params", ""), mesh.get("builtin", "").startswith("super")
        sizes.append(("built-in mesh", f"{params} {params.partition(' ')[0]}" if squared else params))
    most = files.limits.max_faces // 2  # two triangles for each point
    for what, counts in sizes:
        points = 1.0
        for word in counts.split():
            with suppress(ValueError):
                points *= max(float(word), 1.0)
        if points > most:
            raise AssetError(f"{file.name}: a {what} of {points:.4g} points, more than {most}; it is no single object")
