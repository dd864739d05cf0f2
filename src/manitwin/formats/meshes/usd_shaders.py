"""Shaders of USD materials: their kinds, inputs, and texture placement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdShade

_CONTEXTS = ("", "mdl", "mtlx")
"""The universal output of a material, and those of renderers, which are used if the former is not supported."""
_MOST_UPSTREAM = 32


def shaders_of(material: UsdShade.Material) -> Iterator[UsdShade.Shader]:
    """Yield the surface shaders of a material: the universal one, then those of known renderers."""
    for context in _CONTEXTS:
        shader, _, _ = material.ComputeSurfaceSource(context)
        if shader:
            yield shader


def kind_of(shader: UsdShade.Shader) -> str:
    """Return the kind of a shader: its identifier, or that of its MDL."""
    return str(shader.GetIdAttr().Get() or shader.GetSourceAssetSubIdentifier("mdl") or "")[:60]


def asset_of(socket: UsdShade.Input | None) -> tuple[Sdf.Layer, str] | None:
    """Return the layer and the path of the file that an input names; None if it names none."""
    attributes = socket.GetValueProducingAttributes() if socket else []
    asset = attributes[0].Get() if attributes else None
    if not isinstance(asset, Sdf.AssetPath) or not asset.path:
        return None
    return attributes[0].GetPropertyStack(Usd.TimeCode.Default())[0].layer, asset.path


def value_of(socket: UsdShade.Input | None) -> Any:
    """Return an input's constant, None if it has none."""
    attributes = socket.GetValueProducingAttributes() if socket else []
    return attributes[0].Get() if attributes else None


def numbers_of(value: Any, default: tuple[float, ...]) -> tuple[float, ...]:
    """Return as many numbers of a value as ``default`` has (all if it is empty), or ``default`` if there are fewer.

    Shader inputs may have any type that the file writes.
    """
    try:
        numbers = np.asarray(value, np.float64).reshape(-1)
    except (TypeError, ValueError):
        return default
    if len(numbers) < len(default) or not np.isfinite(numbers).all():
        return default
    return tuple(float(each) for each in numbers[: len(default) or None])


def first_number(shader: UsdShade.Shader, default: float, *names: str) -> float:
    """Return the number of the first of these inputs that has one."""
    said = (numbers_of(value_of(shader.GetInput(name)), (np.nan,))[0] for name in names)
    return next((each for each in said if np.isfinite(each)), default)


def upstream(attributes: Sequence[Usd.Attribute]) -> Iterator[UsdShade.Shader]:
    """Yield the shaders of attributes and those connected to them, nearest first."""
    waiting = [attribute.GetPrim() for attribute in attributes]
    seen: set[Sdf.Path] = set()
    while waiting and len(seen) < _MOST_UPSTREAM:
        prim = waiting.pop(0)
        shader = UsdShade.Shader(prim)
        if prim.GetPath() in seen or not shader:
            continue
        seen.add(prim.GetPath())
        yield shader
        for socket in shader.GetInputs():
            waiting += [
                each.GetPrim() for each in socket.GetValueProducingAttributes() if UsdShade.Output.IsOutput(each)
            ]


def same_picture(reader: UsdShade.Shader | None, other: UsdShade.Shader | None) -> bool:
    """Return whether two texture readers read the same file."""
    if reader is None or other is None:
        return False
    return asset_of(reader.GetInput("file")) == asset_of(other.GetInput("file"))


def tint_of(reader: UsdShade.Shader | None) -> tuple[float, ...]:
    """Return the factor by which a texture reader multiplies its colours (UsdUVTexture, ``scale``)."""
    return (1.0, 1.0, 1.0) if reader is None else numbers_of(value_of(reader.GetInput("scale")), (1.0, 1.0, 1.0))


def texture_placement(reader: UsdShade.Shader | None) -> tuple[str | None, np.ndarray | None]:
    """Return the primvar of a texture's coordinates, and the transform ``(3, 3)`` on them; None for the defaults.

    UsdTransform2d scales, rotates counter-clockwise in degrees, and translates. Source: the UsdPreviewSurface specification.
    """
    change = np.eye(3)
    socket = None if reader is None else reader.GetInput("st")
    for _ in range(_MOST_UPSTREAM):
        attributes = socket.GetValueProducingAttributes() if socket else []
        node = UsdShade.Shader(attributes[0].GetPrim()) if attributes else None
        if node is None or not node:
            break
        kind = str(node.GetIdAttr().Get())
        if kind.startswith("UsdPrimvarReader"):
            return str(value_of(node.GetInput("varname")) or "") or None, _unless_identity(change)
        if kind != "UsdTransform2d":
            break
        angle = np.radians(first_number(node, 0.0, "rotation"))
        across, up = numbers_of(value_of(node.GetInput("scale")), (1.0, 1.0))
        right, above = numbers_of(value_of(node.GetInput("translation")), (0.0, 0.0))
        cosine, sine = np.cos(angle), np.sin(angle)
        change = change @ [[cosine * across, -sine * up, right], [sine * across, cosine * up, above], [0, 0, 1]]
        socket = node.GetInput("in")
    return None, _unless_identity(change)


def _unless_identity(change: np.ndarray) -> np.ndarray | None:
    return None if np.allclose(change, np.eye(3)) else change
