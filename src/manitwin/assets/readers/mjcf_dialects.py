"""Rewriting of MJCF dialects: content that older MuJoCo versions or other loaders accept and current MuJoCo refuses."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset_files import AssetFiles

_ORIENTATIONS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")
_PLACED = ("body", "geom", "inertial", "joint", "frame")
MOST_LEFT_OUT = 16
"""Number of kinds of unknown elements and attributes at which a document is refused; fewer are left out."""
_UNKNOWN_ATTRIBUTE = re.compile(r"unrecognized attribute: '([^']+)'\s+Element '([^']+)'")
_UNKNOWN_ELEMENT = re.compile(r"unrecognized element\s+Element '([^']+)'")
_HOLD_SHAPES = frozenset(
    {"worldbody", "body", "frame", "geom", "inertial", "joint", "freejoint", "asset", "mesh", "default"}
)
"""Elements that are never left out: if MuJoCo refuses one, it is misplaced, and is part of the asset."""
_ORIGIN = (0.0, 0.0, 0.0)
_ENDLESS = "0 0 1"
"""Size of an infinite plane, whose half lengths are 0; the third number is the spacing of the drawn grid."""
_MAIN = "main"
_CLASSES = ("class", "childclass")
_NOT_OF_DEFAULTS = ("class",)
"""The attributes of <default>."""


def rewrite_dialects(root: etree._Element, files: AssetFiles) -> None:
    """Rewrite a parsed MJCF in place, with a lenient remark for each deviation, since a strict loader refuses the file.

    Handled are: top-level classes with other names (older MuJoCo used the first one for all elements without a class),
    attributes of <default> besides its class, global coordinates (before 2.3.4) where no body is rotated, fixed joints
    (PyBullet and SAPIEN), assets of the same name (programs that merge files use the first), an <inertial> of the world or
    without a position, planes without a size, and undefined materials and classes. Sites are removed, as they are not shapes.
    """
    for site in list(root.iter("site")):
        site.getparent().remove(site)
    for default in root.iter("default"):
        for key in [key for key in default.attrib if key not in _NOT_OF_DEFAULTS]:
            del default.attrib[key]
            files.remark_leniency(f"<default> has the attribute {key[:40]!r}, which MuJoCo refuses; it was left out")
    _name_top_class(root, files)
    _convert_global_coordinates(root, files)
    for joint in list(root.iter("joint")):
        if joint.get("type") == "fixed":
            joint.getparent().remove(joint)
            files.remark_leniency(
                "a joint is of the type 'fixed', which MuJoCo refuses; its body was read without a joint"
            )
    for inertial in root.xpath("worldbody/inertial"):  # of a part that a program inserts into a body
        inertial.getparent().remove(inertial)
        files.remark_leniency("the world has an <inertial>, which MuJoCo refuses; it was left out")
    for inertial in root.iter("inertial"):
        if inertial.get("fullinertia") is not None and inertial.attrib.pop("quat", None) is not None:
            files.remark_leniency(
                "an <inertial> has fullinertia and quat, which MuJoCo refuses; quat was left out, as older ones did"
            )
        if inertial.get("pos") is None:
            inertial.set("pos", "0 0 0")
            files.remark_leniency("an <inertial> has no pos, which MuJoCo refuses; it was read as at its body's origin")
    _give_planes_a_size(root, files)
    _leave_out_repeated(root, files)
    _leave_out_unknown(root, files)


def remove_unknown_to_schema(said: str, roots: Iterable[etree._Element], files: AssetFiles) -> bool:
    """Remove the element or attribute that MuJoCo ``said`` is unknown from documents; return whether any was found."""
    attribute, element = _UNKNOWN_ATTRIBUTE.search(said), _UNKNOWN_ELEMENT.search(said)
    tag = attribute.group(2) if attribute else element.group(1) if element else None
    if tag is None or (attribute is None and tag in _HOLD_SHAPES):
        return False
    found = [each for root in roots for each in root.iter(tag)]
    for each in found:
        if attribute:
            each.attrib.pop(attribute.group(1), None)
        else:
            each.getparent().remove(each)
    what = f"the attribute {attribute.group(1)[:40]!r} of <{tag[:40]}>" if attribute else f"<{tag[:40]}>"
    files.remark_leniency(f"{what} is none of MJCF, which MuJoCo refuses; it was left out")
    return bool(found)


def _give_planes_a_size(root: etree._Element, files: AssetFiles) -> None:
    """Make planes without a size infinite, as PyBullet does, unless a default for geoms has a size."""
    if any(geom.get("size") is not None for geom in root.iterfind("default//geom")):
        return
    for geom in root.iterfind("worldbody//geom[@type='plane']"):
        if geom.get("size") is None:
            geom.set("size", _ENDLESS)
            files.remark_leniency("a plane has no size, which MuJoCo refuses; it was read as one without an end")


def _name_top_class(root: etree._Element, files: AssetFiles) -> None:
    """Name the first top-level class ``main``, and nest other named ones in it."""
    tops = root.findall("default")
    named = [top for top in tops if top.get("class", _MAIN) != _MAIN]
    for top in named:
        name = top.get("class")
        files.remark_leniency(
            f"the top-level <default> is called {name[:60]!r}, which MuJoCo refuses; it was read as older ones do"
        )
        if top is not tops[0]:
            root.remove(top)
            tops[0].append(top)
            continue
        del top.attrib["class"]
        for element in root.iter(etree.Element):
            for key in _CLASSES:
                if element.get(key) == name:
                    element.set(key, _MAIN)


def _convert_global_coordinates(root: etree._Element, files: AssetFiles) -> None:
    """Convert global positions to positions relative to the parent body; files with rotated bodies are left to MuJoCo."""
    compilers = [each for each in root.iterfind("compiler") if each.get("coordinate") == "global"]
    bodies = list(root.iterfind("worldbody//body"))
    if not compilers or any(body.get(key) is not None for body in bodies for key in _ORIENTATIONS):
        return
    for compiler in compilers:
        del compiler.attrib["coordinate"]
    files.remark_leniency("its coordinates are global, which MuJoCo refuses; they were read as older ones do")
    places: dict[etree._Element, tuple[float, float, float]] = {}
    for body in bodies:  # a body without a position has that of its parent
        places[body] = _three(body.get("pos"), places.get(body.getparent(), _ORIGIN))
    for element in [each for each in root.iterfind("worldbody//*") if each.tag in _PLACED]:
        origin = places.get(element.getparent(), _ORIGIN)
        for key in ("pos", "fromto"):
            with suppress(ValueError):  # MuJoCo reports the error
                values = [float(word) for word in element.get(key, "").split()]
                moved = [value - origin[axis % 3] for axis, value in enumerate(values)]
                if moved:
                    element.set(key, " ".join(map(repr, moved)))


def _three(text: str | None, otherwise: tuple[float, float, float]) -> tuple[float, float, float]:
    try:
        x, y, z = (float(word) for word in (text or "").split())
    except ValueError:
        return otherwise
    return x, y, z


def _leave_out_repeated(root: etree._Element, files: AssetFiles) -> None:
    """Remove assets and names that are defined twice: programs merge parts of robots and scenes that bring their own."""
    seen: set[tuple[str, str]] = set()
    for entry in root.xpath("asset/*[@name]"):
        key = (entry.tag, entry.get("name"))
        if key in seen:
            entry.getparent().remove(entry)
            files.remark_leniency(
                f"<{entry.tag}> {entry.get('name')[:60]!r} is written twice, which MuJoCo refuses; the first was read"
            )
        seen.add(key)
    named: set[tuple[str, str]] = set()
    for element in root.xpath("worldbody//geom[@name] | worldbody//body[@name] | worldbody//joint[@name]"):
        key = (element.tag, element.get("name"))
        if key in named:
            del element.attrib["name"]
            files.remark_leniency(f"two <{key[0]}> are called {key[1][:60]!r}, which MuJoCo refuses; both were read")
        named.add(key)


def _leave_out_unknown(root: etree._Element, files: AssetFiles) -> None:
    materials = {entry.get("name") for entry in root.iterfind("asset/material")}
    classes = {_MAIN, *(default.get("class") for default in root.iter("default"))}
    for element in (*root.iterfind("worldbody//*"), *root.iterfind("default//*")):
        name = element.get("material")
        if element.tag == "geom" and name is not None and name not in materials:
            del element.attrib["material"]
            files.remark_leniency(
                f"the material {name[:60]!r} is nowhere written, which MuJoCo refuses; its shapes are grey"
            )
        for key in [key for key in _CLASSES if element.get(key, _MAIN) not in classes]:
            name = element.attrib.pop(key)
            files.remark_leniency(f"the class {name[:60]!r} is nowhere written, which MuJoCo refuses; it was left out")
