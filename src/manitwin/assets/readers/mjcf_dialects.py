"""What older MuJoCo and other loaders accept in an MJCF file and MuJoCo of today refuses, rewritten as they read it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset_files import AssetFiles

_ORIENTATIONS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")
_PLACED = ("body", "geom", "inertial", "joint", "frame")
MOST_LEFT_OUT = 16
"""Kinds of unknown elements and attributes from which on a document is refused; fewer are left out."""
_UNKNOWN_ATTRIBUTE = re.compile(r"unrecognized attribute: '([^']+)'\s+Element '([^']+)'")
_UNKNOWN_ELEMENT = re.compile(r"unrecognized element\s+Element '([^']+)'")
_HOLD_SHAPES = frozenset(
    {"worldbody", "body", "frame", "geom", "inertial", "joint", "freejoint", "asset", "mesh", "default"}
)
"""Elements that are never left out: one that MuJoCo does not know stands in a wrong place, and is a part of the asset."""
_ORIGIN = (0.0, 0.0, 0.0)
_ENDLESS = "0 0 1"
"""The size of a plane without an end, of half lengths 0; the third number is the spacing of the grid that is drawn."""
_MAIN = "main"
_CLASSES = ("class", "childclass")
_NOT_OF_DEFAULTS = ("class",)
"""The attributes that <default> has."""


def rewrite_dialects(root: etree._Element, files: AssetFiles) -> None:
    """Rewrite a parsed MJCF, each thing with a remark: a loader that goes by the letter would refuse the file.

    Top-level classes under other names (older MuJoCo took the first one for all that have no class), attributes of <default>
    beside its class, coordinates of the world (before 2.3.4) where no body is turned, fixed joints (of PyBullet and SAPIEN),
    assets of one name (programs that join files take the first), an <inertial> of the world or without a place, planes without a
    size, and materials and classes that are nowhere written. Sites are no shapes.
    """
    for site in list(root.iter("site")):
        site.getparent().remove(site)
    for default in root.iter("default"):
        for key in [key for key in default.attrib if key not in _NOT_OF_DEFAULTS]:
            del default.attrib[key]
            files.took_leniently(f"<default> has the attribute {key[:40]!r}, which MuJoCo refuses; it was left out")
    _name_top_class(root, files)
    _take_global_coordinates(root, files)
    for joint in list(root.iter("joint")):
        if joint.get("type") == "fixed":
            joint.getparent().remove(joint)
            files.took_leniently(
                "a joint is of the type 'fixed', which MuJoCo refuses; its body was read without a joint"
            )
    for inertial in root.xpath("worldbody/inertial"):  # of a part that a program puts into a body
        inertial.getparent().remove(inertial)
        files.took_leniently("the world has an <inertial>, which MuJoCo refuses; it was left out")
    for inertial in root.iter("inertial"):
        if inertial.get("fullinertia") is not None and inertial.attrib.pop("quat", None) is not None:
            files.took_leniently(
                "an <inertial> has fullinertia and quat, which MuJoCo refuses; quat was left out, as older ones did"
            )
        if inertial.get("pos") is None:
            inertial.set("pos", "0 0 0")
            files.took_leniently("an <inertial> has no pos, which MuJoCo refuses; it was read as at its body's origin")
    _give_planes_a_size(root, files)
    _leave_out_repeated(root, files)
    _leave_out_unknown(root, files)


def leave_out_unknown_to_schema(said: str, roots: Iterable[etree._Element], files: AssetFiles) -> bool:
    """Take out of documents what MuJoCo ``said`` that its schema does not know; return whether that was anything."""
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
    files.took_leniently(f"{what} is none of MJCF, which MuJoCo refuses; it was left out")
    return bool(found)


def _give_planes_a_size(root: etree._Element, files: AssetFiles) -> None:
    """Let planes that say no size have no end, as PyBullet has it, where no default has one for them."""
    if any(geom.get("size") is not None for geom in root.iterfind("default//geom")):
        return
    for geom in root.iterfind("worldbody//geom[@type='plane']"):
        if geom.get("size") is None:
            geom.set("size", _ENDLESS)
            files.took_leniently("a plane has no size, which MuJoCo refuses; it was read as one without an end")


def _name_top_class(root: etree._Element, files: AssetFiles) -> None:
    """Call the first top-level class ``main``, and put others with names into it."""
    tops = root.findall("default")
    named = [top for top in tops if top.get("class", _MAIN) != _MAIN]
    for top in named:
        name = top.get("class")
        files.took_leniently(
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


def _take_global_coordinates(root: etree._Element, files: AssetFiles) -> None:
    """Write places that are given in the world relative to their bodies, as MuJoCo takes them; a turned body is left to it."""
    compilers = [each for each in root.iterfind("compiler") if each.get("coordinate") == "global"]
    bodies = list(root.iterfind("worldbody//body"))
    if not compilers or any(body.get(key) is not None for body in bodies for key in _ORIENTATIONS):
        return
    for compiler in compilers:
        del compiler.attrib["coordinate"]
    files.took_leniently("its coordinates are global, which MuJoCo refuses; they were read as older ones do")
    places: dict[etree._Element, tuple[float, float, float]] = {}
    for body in bodies:  # one without a place has that of what holds it
        places[body] = _three(body.get("pos"), places.get(body.getparent(), _ORIGIN))
    for element in [each for each in root.iterfind("worldbody//*") if each.tag in _PLACED]:
        origin = places.get(element.getparent(), _ORIGIN)
        for key in ("pos", "fromto"):
            with suppress(ValueError):  # MuJoCo says what is wrong with it
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
    """Take out assets that are written twice: parts of robots and scenes bring their own, and are joined by programs."""
    seen: set[tuple[str, str]] = set()
    for entry in root.xpath("asset/*[@name]"):
        key = (entry.tag, entry.get("name"))
        if key in seen:
            entry.getparent().remove(entry)
            files.took_leniently(
                f"<{entry.tag}> {entry.get('name')[:60]!r} is written twice, which MuJoCo refuses; the first was read"
            )
        seen.add(key)
    named: set[tuple[str, str]] = set()
    for element in root.xpath("worldbody//geom[@name] | worldbody//body[@name] | worldbody//joint[@name]"):
        key = (element.tag, element.get("name"))
        if key in named:
            del element.attrib["name"]
            files.took_leniently(f"two <{key[0]}> are called {key[1][:60]!r}, which MuJoCo refuses; both were read")
        named.add(key)


def _leave_out_unknown(root: etree._Element, files: AssetFiles) -> None:
    materials = {entry.get("name") for entry in root.iterfind("asset/material")}
    classes = {_MAIN, *(default.get("class") for default in root.iter("default"))}
    for element in (*root.iterfind("worldbody//*"), *root.iterfind("default//*")):
        name = element.get("material")
        if element.tag == "geom" and name is not None and name not in materials:
            del element.attrib["material"]
            files.took_leniently(
                f"the material {name[:60]!r} is nowhere written, which MuJoCo refuses; its shapes are grey"
            )
        for key in [key for key in _CLASSES if element.get(key, _MAIN) not in classes]:
            name = element.attrib.pop(key)
            files.took_leniently(f"the class {name[:60]!r} is nowhere written, which MuJoCo refuses; it was left out")
