"""Conversion of MaterialX documents to USD layers, because this build of USD has no plug-in for ``.mtlx``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from lxml import etree  # type: ignore[import-untyped]
from pxr import Sdf, Tf, Usd, UsdGeom, UsdShade

from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import srgb_to_linear
from manitwin.formats.xml_file import parse_xml

SUFFIX = ".mtlx"
_ROOT, _MATERIALS = "MaterialX", "Materials"
_MOST_NODES = 10_000
_TYPES: dict[str, tuple[Any, int]] = {
    "float": (Sdf.ValueTypeNames.Float, 1),
    "color3": (Sdf.ValueTypeNames.Color3f, 3),
    "vector3": (Sdf.ValueTypeNames.Float3, 3),
    "vector2": (Sdf.ValueTypeNames.Float2, 2),
}
_IN_SRGB = "srgb_texture"


def mtlx_layer(data: bytes, name: str, source: MeshSource) -> Sdf.Layer:
    """Return an in-memory layer with ``/MaterialX/Materials`` and a material below it for each of a document.

    Each material has its surface and the nodes that it reads, with constants and files. Connections between nodes are by name
    only, and included documents are not read. Raises AssetError for anything but MaterialX. Sources: the MaterialX
    specification 1.38; UsdMtlx for the prim paths.
    """
    root = parse_xml(data, "materialx", name)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(layer)
    stage.SetDefaultPrim(UsdGeom.Scope.Define(stage, f"/{_ROOT}").GetPrim())
    scope = UsdGeom.Scope.Define(stage, f"/{_ROOT}/{_MATERIALS}").GetPath()
    if any(_tag(each) == "include" for each in root):
        source.add_finding(f"documents that {name[:80]} includes were not read")
    budget = iter(range(_MOST_NODES))
    for element in root:
        if _tag(element) != "surfacematerial":
            continue
        material = UsdShade.Material.Define(stage, scope.AppendChild(Tf.MakeValidIdentifier(element.get("name") or "")))
        for socket in _inputs(element):
            node = _named(root, socket.get("nodename")) if socket.get("name") == "surfaceshader" else None
            if node is not None:
                shader = _Nodes(stage, root, material.GetPath(), budget).shader(node)
                if shader is not None:
                    material.CreateSurfaceOutput("mtlx").ConnectToSource(shader.ConnectableAPI(), "out")
    return layer


class _Nodes:
    """Shaders for the nodes of one material, each created once."""

    def __init__(self, stage: Usd.Stage, root: etree._Element, material: Sdf.Path, budget: Iterator[int]):
        self._stage, self._root, self._material, self._budget = stage, root, material, budget
        self._made: dict[etree._Element, UsdShade.Shader] = {}

    def shader(self, node: etree._Element) -> UsdShade.Shader | None:
        """Return the shader of a node with all its inputs; None if there are too many nodes."""
        waiting = [node]
        while waiting:
            each = waiting.pop()
            if each in self._made:
                continue
            if next(self._budget, None) is None:
                return None
            path = self._material.AppendChild(Tf.MakeValidIdentifier(f"{each.get('name') or 'node'}_{len(self._made)}"))
            made = UsdShade.Shader.Define(self._stage, path)
            made.CreateIdAttr(f"ND_{_tag(each)}_{each.get('type') or ''}")
            self._made[each] = made
            waiting += [
                behind for socket in _inputs(each) if (behind := self._connected_node(socket, each)) is not None
            ]
        for each, made in self._made.items():
            for socket in _inputs(each):
                self._connect(made, socket, each)
        return self._made[node]

    def _connect(self, shader: UsdShade.Shader, socket: etree._Element, node: etree._Element) -> None:
        name, behind = socket.get("name") or "", self._connected_node(socket, node)
        if not Sdf.Path.IsValidNamespacedIdentifier(name):
            return
        if behind is not None:
            kind = _TYPES.get(socket.get("type") or "", (Sdf.ValueTypeNames.Token, 0))[0]
            shader.CreateInput(name, kind).ConnectToSource(self._made[behind].ConnectableAPI(), "out")
            return
        said = self._interface(socket, node)
        value = said.get("value")
        if value is not None and said.get("type") == "filename":
            prefix = "".join(above.get("fileprefix") or "" for above in reversed(list(said.iterancestors())))
            shader.CreateInput(name, Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(_path(prefix, value)))
        elif value is not None and said.get("type") in _TYPES:
            kind, count = _TYPES[said.get("type")]
            numbers = _numbers(value, count, in_srgb=said.get("colorspace") == _IN_SRGB)
            if numbers is not None:
                shader.CreateInput(name, kind).Set(numbers[0] if count == 1 else tuple(numbers))

    def _connected_node(self, socket: etree._Element, node: etree._Element) -> etree._Element | None:
        """Return the node connected to an input: in the same scope, or through the output of a graph."""
        socket = self._interface(socket, node)
        scope = node.getparent() if node.getparent() is not None else self._root
        if socket.get("nodegraph"):
            graph = _named(self._root, socket.get("nodegraph"))
            outputs = [] if graph is None else [each for each in graph if _tag(each) == "output"]
            wanted = [each for each in outputs if each.get("name") == socket.get("output")] or outputs[:1]
            return _named(graph, wanted[0].get("nodename")) if wanted else None
        return _named(scope, socket.get("nodename"))

    def _interface(self, socket: etree._Element, node: etree._Element) -> etree._Element:
        """Return the graph input that a node's input refers to, or the input itself."""
        named, graph = socket.get("interfacename"), node.getparent()
        if not named or graph is None:
            return socket
        return next((each for each in _inputs(graph) if each.get("name") == named), socket)


def _tag(element: etree._Element) -> str:
    return str(element.tag).rpartition("}")[2] if isinstance(element.tag, str) else ""


def _inputs(element: etree._Element) -> list[etree._Element]:
    return [each for each in element if _tag(each) == "input"]


def _named(scope: etree._Element | None, name: str | None) -> etree._Element | None:
    """Return the node of a name in a document or graph, ignoring inputs and outputs."""
    if scope is None or not name:
        return None
    nodes = (each for each in scope if _tag(each) not in ("input", "output", ""))
    return next((each for each in nodes if each.get("name") == name), None)


def _path(prefix: str, value: str) -> str:
    """Return the path of a file with its prefix, without characters that are invalid in USD asset paths."""
    return "".join(each for each in prefix + value if each.isprintable() and each != "@")


def _numbers(value: str, count: int, *, in_srgb: bool) -> list[float] | None:
    try:
        numbers = np.array([float(word) for word in value.replace(",", " ").split()])
    except ValueError:
        return None
    if len(numbers) != count or not np.isfinite(numbers).all():
        return None
    return [float(each) for each in (srgb_to_linear(np.clip(numbers, 0, 1)) if in_srgb else numbers)]
