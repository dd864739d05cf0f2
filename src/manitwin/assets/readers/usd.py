"""USD and USDZ of any tool: geometry, mass, friction and what is said of the source."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Tf, Usd, UsdGeom

from manitwin.assets.asset import Asset
from manitwin.assets.asset_files import MESH_LIMITS
from manitwin.assets.detect import only_file
from manitwin.assets.licence_text import stated_licence
from manitwin.assets.readers.usd_layers import LayerFiles
from manitwin.assets.readers.usd_physics import declared_contact, declared_inertial
from manitwin.assets.readers.usd_shapes import StageShapes
from manitwin.assets.readers.usd_textures import LayeredSurfaces
from manitwin.errors import AssetError, InputError
from manitwin.formats.isolated import MAX_MEMORY_BYTES, ProcessCrashed, run_isolated
from manitwin.formats.meshes.source import MeshSource


def read(path: Path) -> Asset:
    """Read a USD file, or the only one in a folder, in a process of its own; the asset's axes are the stage's.

    Layers, references, payloads and textures are followed inside of the file's folder only. Raises AssetError naming what
    is broken, also where the USD library crashes on it.
    """
    try:
        asset: Asset = run_isolated("manitwin.assets.readers.usd:read_here", path.absolute())
    except ProcessCrashed as error:
        raise AssetError(f"{path}: its USD is so broken that the USD library crashes on it; export it again") from error
    except MemoryError as error:
        raise AssetError(
            f"{path}: it asks for more than {MAX_MEMORY_BYTES >> 30} GiB of memory; simplify it"
        ) from error
    return asset


def read_here(path: Path) -> Asset:
    """Read it in this process, which a broken file may end; raises AssetError."""
    file = only_file(path) if path.is_dir() else path
    source = MeshSource(file, MESH_LIMITS)
    try:
        layers = LayerFiles(source)
        return _asset(path, file, layers.compose(), layers, source)
    except InputError as error:
        raise AssetError(error.detail) from error
    except Tf.ErrorException as error:
        raise AssetError(f"{file}: its USD is broken; export it again") from error
    except UnicodeDecodeError as error:
        raise AssetError(f"{file}: a text in it is not UTF-8; export it again") from error


def _asset(path: Path, file: Path, stage: Usd.Stage, layers: LayerFiles, source: MeshSource) -> Asset:
    declared = UsdGeom.StageHasAuthoredMetersPerUnit(stage)
    unit_m = UsdGeom.GetStageMetersPerUnit(stage)
    if not (np.isfinite(unit_m) and 0 < unit_m < 1e6):
        raise AssetError(f"{file}: its metersPerUnit is {unit_m}; mend it")
    if not declared:
        source.find(f"it declares no metersPerUnit: USD's rule of {unit_m:g} m was taken")
    shapes = StageShapes(stage, unit_m, LayeredSurfaces(layers, source), source)
    visual, collision = shapes.visual(), shapes.collision()
    if not visual and not collision:
        raise AssetError(f"{file}: no prim of it has a shape; it may be a layer of another asset")
    root = stage.GetDefaultPrim()
    if not root:
        source.find("it has no default prim: nothing can reference it without a path")
    said = _said(stage, root)
    licence, attribution = stated_licence(_texts(stage, root))
    named = said.get("license") or said.get("licence") or licence
    return Asset(
        format="usd",
        path=path,
        name=root.GetName() if root else file.stem,
        visual=visual,
        collision=collision,
        up="z" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else "y",
        unit_m=unit_m if declared else None,
        inertial=declared_inertial(stage, shapes, unit_m, source),
        contact=replace(declared_contact(shapes, source), material=said.get("material")),
        category=said.get("category"),
        captions=(said["caption"],) if said.get("caption") else (),
        license=None if named == "unknown" else named,
        attribution=said.get("attribution") or said.get("author") or attribution,
        files=tuple(sorted(layers.files)),
        missing_files=tuple(sorted(layers.missing)),
        remarks=tuple(source.findings),
    )


def _said(stage: Usd.Stage, root: Usd.Prim) -> dict[str, str]:
    """Return the texts in the custom data of the layer and of the default prim, also one level below; the prim's win."""
    found: dict[str, str] = {}
    for data in (stage.GetRootLayer().customLayerData, root.GetCustomData() if root else {}):
        for values in (data, *(value for value in data.values() if isinstance(value, dict))):
            found |= {key.lower(): value for key, value in values.items() if isinstance(value, str) and value}
    return found


def _texts(stage: Usd.Stage, root: Usd.Prim) -> Iterator[str]:
    layer: Any = stage.GetRootLayer()
    yield from (layer.documentation, layer.comment)
    if root:
        yield root.GetDocumentation() or ""
