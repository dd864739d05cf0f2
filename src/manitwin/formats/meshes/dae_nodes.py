"""Geometries shown by the nodes of a COLLADA file: descriptions name nodes, while mesh parts are named by geometry."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

from manitwin.errors import AssetError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.xml_file import parse_xml


def geometries_of_nodes(path: Path, max_bytes: int, inside: Path) -> dict[str, frozenset[str]]:
    """Return the ids of the geometries shown by the nodes of each name; a geometry's own name maps to itself if no node has it.

    Gazebo names the parts of a mesh by their nodes (ColladaLoader, ``currentNodeName``). Raises AssetError if the file cannot
    be read.
    """
    data = read_bytes(path, max_bytes, AssetError, inside=inside)
    root = parse_xml(data, "COLLADA", path.name, comments=False, max_bytes=None)
    found: defaultdict[str, set[str]] = defaultdict(set)
    for node in root.iter("{*}node"):
        shown = {(each.get("url") or "").removeprefix("#") for each in node.iterfind("{*}instance_geometry")}
        found[node.get("name") or node.get("id") or ""] |= shown
    for geometry in root.iter("{*}geometry"):
        own = geometry.get("id") or ""
        for name in (geometry.get("name") or own, own):
            if not found[name]:
                found[name] = {own}
    return {name: frozenset(ids) for name, ids in found.items() if name and ids}
