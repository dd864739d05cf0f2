"""USD and USDZ of any tool: geometry, mass, friction and what is said of the source."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, UsdPhysics, UsdShade

from manitwin.assets.asset import Asset, Contact, Inertial, combined_inertial
from manitwin.assets.asset_files import MESH_LIMITS
from manitwin.assets.filled_hulls import filled_hulls
from manitwin.assets.licence_text import stated_licence
from manitwin.assets.read import only_file
from manitwin.assets.readers.usd_layers import LayerFiles
from manitwin.assets.readers.usd_shapes import LayeredSurfaces, StageShapes
from manitwin.assets.root import root_of
from manitwin.assets.within_limits import LIMITS, why_ended
from manitwin.errors import AssetError, InputError
from manitwin.formats.isolated import ProcessCrashed, TookTooLong, run_isolated
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.formats.meshes.usd_errors import broken
from manitwin.geometry.poses import rotation_from_quaternion_wxyz


def read(path: Path, root: Path | None = None, limits: MeshLimits = MESH_LIMITS) -> Asset:
    """Read a USD file, or the only one in a folder, in a process of its own; the asset's axes are the stage's.

    Layers, references, payloads and textures are followed inside of ``root`` only (``root_of`` the path by default). Raises
    AssetError naming what is broken, also where the USD library crashes on it.
    """
    try:
        asset: Asset = run_isolated(
            "manitwin.assets.readers.usd:read_here", path.absolute(), root or root_of(path), limits, limits=LIMITS
        )
    except (TookTooLong, MemoryError) as error:
        raise AssetError(f"{path}: {why_ended(error)}") from error
    except ProcessCrashed as error:
        raise AssetError(f"{path}: its USD is so broken that the USD library crashes on it; export it again") from error
    return asset


def read_here(path: Path, root: Path | None = None, limits: MeshLimits = MESH_LIMITS) -> Asset:
    """Read it in this process, which a broken file may end, below its own folder or a ``root``; raises AssetError."""
    file = only_file(path) if path.is_dir() else path
    source = MeshSource(file, limits, root=root)
    try:
        layers = LayerFiles(source)
        return _asset(path, file, layers.compose(), layers, source)
    except InputError as error:
        raise AssetError(error.detail) from error
    except Tf.ErrorException as error:
        raise AssetError(f"{file}: {broken(error)}; mend it there, or export it again") from error
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
        raise AssetError(f"{file}: no prim of it has a shape{_but(layers)}")
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


def _but(layers: LayerFiles) -> str:
    """Return what there is instead of shapes."""
    if layers.missing:
        return f", and layers that it names are not there: {', '.join(sorted(layers.missing)[:3])}"
    return "; it may be a layer of another asset"


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


def declared_inertial(stage: Usd.Stage, shapes: StageShapes, unit_m: float, source: MeshSource) -> Inertial:
    """Return the mass, the centre of mass and the inertia that MassAPI declares, in kg and m along the stage's axes.

    A mass on a prim stands for all below it; several beside each other are taken as one body. Values that the schema
    calls unspecified (no inertia, no centre) are None; a mass of 0 that somebody wrote is kept.
    Source: UsdPhysics schema, MassAPI.
    """
    unit_kg = UsdPhysics.GetStageKilogramsPerUnit(stage)
    if not (np.isfinite(unit_kg) and unit_kg > 0):
        raise AssetError(f"{source.path}: its kilogramsPerUnit is {unit_kg}; mend it")
    with_mass = [prim for prim in shapes.prims if prim.HasAPI(UsdPhysics.MassAPI)]
    bodies: list[Inertial] = []
    taken: set[Sdf.Path] = set()
    for prim in with_mass:
        if any(prim.GetPath().HasPrefix(path) for path in taken):
            continue
        body = _of_prim(prim, shapes.to_world(prim), unit_m, unit_kg, source)
        if body.mass_kg is not None:
            taken.add(prim.GetPath())
            bodies.append(body)
        elif body.inertia_kg_m2 is not None or body.center_of_mass_m is not None:
            source.find(f"{prim.GetName()} has a centre of mass or an inertia and no mass")
    _remark_bodies(shapes, with_mass, bodies, source)
    return combined_inertial(bodies) if bodies else _of_densities(shapes, unit_m, unit_kg, source)


def _of_densities(shapes: StageShapes, unit_m: float, unit_kg: float, source: MeshSource) -> Inertial:
    """Return what densities make of the convex hulls of collision shapes; nothing where one of them has none.

    A density is that of the nearest MassAPI above a shape, else of the material that is bound to it (UsdPhysics, density).
    """
    filled: list[tuple[np.ndarray, float]] = []
    for prim, shape in zip(shapes.colliders(), shapes.collision(), strict=True):
        density = _density(prim, source)
        if not density or density < 0:
            return Inertial()
        filled.append((shape.vertices, density * unit_kg / unit_m**3))
    found = filled_hulls(filled)
    if found.mass_kg is not None:
        source.find(
            "its mass follows from a density; it, the centre and the inertia are of the hulls of its collision shapes"
        )
    return found


def _density(prim: Usd.Prim, source: MeshSource) -> float | None:
    above = prim
    while above and not above.IsPseudoRoot():
        if above.HasAPI(UsdPhysics.MassAPI):
            density = _authored(UsdPhysics.MassAPI(above).GetDensityAttr(), source)
            if density:
                return density
        above = above.GetParent()
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
    bound = material.GetPrim() if material else None
    if bound is None or not bound.HasAPI(UsdPhysics.MaterialAPI):
        return None
    return _authored(UsdPhysics.MaterialAPI(bound).GetDensityAttr(), source)


def declared_contact(shapes: StageShapes, source: MeshSource) -> Contact:
    """Return the friction and restitution of the material bound to the collision shapes; the first where they differ."""
    found: dict[str, Contact] = {}
    for prim in shapes.colliders():
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
        bound = material.GetPrim() if material else None
        if bound is None or not bound.HasAPI(UsdPhysics.MaterialAPI) or str(bound.GetPath()) in found:
            continue
        api = UsdPhysics.MaterialAPI(bound)
        found[str(bound.GetPath())] = Contact(
            _authored(api.GetStaticFrictionAttr(), source),
            _authored(api.GetDynamicFrictionAttr(), source),
            _authored(api.GetRestitutionAttr(), source),
        )
    contacts = list(found.values())
    if any(contact != contacts[0] for contact in contacts):
        source.find(f"{len(contacts)} physics materials are bound to its collision shapes; the first was taken")
    if not contacts and any(prim.HasAPI(UsdPhysics.MaterialAPI) for prim in shapes.prims):
        source.find("it has a physics material that is bound to no collision shape")
    return contacts[0] if contacts else Contact()


def _of_prim(prim: Usd.Prim, to_world: np.ndarray, unit_m: float, unit_kg: float, source: MeshSource) -> Inertial:
    api = UsdPhysics.MassAPI(prim)
    mass = _authored(api.GetMassAttr(), source)
    density = _authored(api.GetDensityAttr(), source)
    if density and not mass:
        source.find(
            f"{prim.GetName()} declares a density of {density * unit_kg / unit_m**3:g} kg/m3 in place of a mass"
        )
    center = api.GetCenterOfMassAttr().Get()
    moments = np.array(api.GetDiagonalInertiaAttr().Get(), dtype=float)
    turn = api.GetPrincipalAxesAttr().Get()
    wxyz = np.array([turn.GetReal(), *turn.GetImaginary()], dtype=float)
    declared = center is not None and not np.isneginf(np.array(center)).any()  # the fallback, -inf, is unspecified
    if not np.isfinite(moments).all() or not np.isfinite(wxyz).all() or (declared and not np.isfinite(center).all()):
        raise AssetError(f"{source.path}: the mass properties of {prim.GetPath()} are not finite; mend them")
    left, stretch, right = np.linalg.svd(to_world[:3, :3] / unit_m)
    if np.abs(stretch - 1).max() > 1e-5:
        source.find(
            f"{prim.GetName()} is scaled by {stretch.round(6).tolist()}, which its mass and inertia do not follow"
        )
    axes = rotation_from_quaternion_wxyz(wxyz) if np.linalg.norm(wxyz) > 0 else np.eye(3)
    turned = left @ right @ axes
    inertia = turned @ np.diag(moments * unit_kg * unit_m**2) @ turned.T if moments.any() else None
    center_m = to_world[:3, :3] @ np.array(center) + to_world[:3, 3] if declared else None
    return Inertial(None if mass is None else mass * unit_kg, center_m, inertia)


def _remark_bodies(shapes: StageShapes, with_mass: list[Usd.Prim], found: list[Inertial], source: MeshSource) -> None:
    rigid = [prim for prim in shapes.prims if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    if not rigid:
        source.find("no prim of it is a rigid body")
    if len(rigid) > 1:
        source.find(f"its {len(rigid)} rigid bodies were taken as one")
    if with_mass and not found:
        source.find("it has a mass API and no mass")
    if any(UsdPhysics.RigidBodyAPI(prim).GetKinematicEnabledAttr().Get() for prim in rigid):
        source.find("its rigid body is kinematic: it moves only where it is moved")
    if any(prim.HasAPI(UsdPhysics.ArticulationRootAPI) or prim.IsA(UsdPhysics.Joint) for prim in shapes.prims):
        source.find("it has joints, which were left out")


def _authored(attribute: Usd.Attribute, source: MeshSource) -> float | None:
    """Return a number that somebody wrote, None for the schema's fallback."""
    if not attribute or not attribute.HasAuthoredValue():
        return None
    value: Any = attribute.Get(Usd.TimeCode.EarliestTime())
    if value is None or not np.isfinite(value):
        raise AssetError(f"{source.path}: {attribute.GetPath()} is {value}; mend it")
    return float(str(np.float32(value)))  # the number as it was meant: 0.45, not 0.44999998807907104
