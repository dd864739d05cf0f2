"""Reader of USD and USDZ assets: geometry, mass, friction, joints and source information."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pxr import Tf, Usd, UsdGeom, UsdPhysics

from manitwin.assets.articulation import Articulation, AssetLink, LinkTree
from manitwin.assets.asset import Asset, Inertial, combined_inertial
from manitwin.assets.asset_files import MESH_LIMITS
from manitwin.assets.joints import Joints
from manitwin.assets.licence_text import stated_licence
from manitwin.assets.read import only_file
from manitwin.assets.readers.usd_layers import LayerFiles
from manitwin.assets.readers.usd_links import StageSelection, select_bodies
from manitwin.assets.readers.usd_masses import (
    StageUnits,
    complete_from_hulls,
    declared_contact,
    declared_inertial,
    is_rigid_body,
)
from manitwin.assets.readers.usd_shapes import Felt, LayeredSurfaces, Seen, StageShapes, check_prims
from manitwin.assets.root import root_of
from manitwin.assets.within_limits import LIMITS, termination_cause
from manitwin.errors import AssetError, InputError
from manitwin.formats.isolated import ProcessCrashed, ProcessTimeout, run_isolated
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.formats.meshes.usd_errors import broken_usd_cause
from manitwin.formats.meshes.usd_placed_prims import PlacedPrim, placed_prims
from manitwin.formats.meshes.usd_skin import Skeletons


def read(path: Path, root: Path | None = None, limits: MeshLimits = MESH_LIMITS, *, joints: Joints = "part") -> Asset:
    """Read a USD file, or the only one in a folder, in an isolated process; the asset's axes are those of the stage.

    Layers, references, payloads and textures are followed only inside ``root`` (default: ``root_of`` the path). ``joints``:
    "lock" and "keep" read the first articulated object, "part" the whole stage in its pose. Raises AssetError naming what is
    broken, also if the USD library crashes.
    """
    function = "manitwin.assets.readers.usd:read_here"
    try:
        asset: Asset = run_isolated(function, path.absolute(), root or root_of(path), limits, joints, limits=LIMITS)
    except (ProcessTimeout, MemoryError) as error:
        raise AssetError(f"{path}: {termination_cause(error)}") from error
    except ProcessCrashed as error:
        raise AssetError(f"{path}: its USD is so broken that the USD library crashes on it; export it again") from error
    return asset


def read_here(path: Path, root: Path | None = None, limits: MeshLimits = MESH_LIMITS, joints: Joints = "part") -> Asset:
    """Read a USD asset in this process, which a broken file may crash, below its own folder or ``root``; raises AssetError."""
    file = only_file(path) if path.is_dir() else path
    source = MeshSource(file, limits, root=root)
    try:
        layers = LayerFiles(source)
        return _asset(path, layers.compose(), layers, joints, source)
    except InputError as error:
        raise AssetError(error.detail) from error
    except Tf.ErrorException as error:
        raise AssetError(f"{file}: {broken_usd_cause(error)}; mend it there, or export it again") from error
    except UnicodeDecodeError as error:
        raise AssetError(f"{file}: a text in it is not UTF-8; export it again") from error


def _asset(path: Path, stage: Usd.Stage, layers: LayerFiles, joints: Joints, source: MeshSource) -> Asset:
    file, units, placed = source.path, StageUnits.of(stage, source), placed_prims(stage, source)
    check_prims(placed, source)
    chosen = select_bodies(stage, placed, units, joints, source)
    shapes = StageShapes(chosen.placed, units.m, LayeredSurfaces(layers, source), Skeletons(stage, source), source)
    seen, felt = shapes.visual(), shapes.collision()
    if not seen and not felt:
        raise AssetError(f"{file}: no prim of it has a shape{_empty_stage_clause(layers)}")
    root = stage.GetDefaultPrim()
    if not root:
        source.add_finding("it has no default prim: nothing can reference it without a path")
    said = _custom_texts(stage, root)
    licence, attribution = stated_licence(_texts(stage, root))
    named = said.get("license") or said.get("licence") or licence
    inertial, articulation = declared_inertial(chosen.placed, felt, units, source), None
    if chosen.moving is not None:
        inertial, articulation = _articulation(chosen, chosen.moving, seen, felt, units, source)
    _remark_bodies(chosen, source)
    return Asset(
        format="usd",
        path=path,
        name=root.GetName() if root else file.stem,
        visual=tuple(part for part, _ in seen),
        collision=tuple(shape for shape, _ in felt),
        up="z" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else "y",
        unit_m=units.m if units.declared else None,
        inertial=inertial,
        contact=replace(declared_contact(chosen.placed, felt, source), material=said.get("material")),
        category=said.get("category"),
        captions=(said["caption"],) if said.get("caption") else (),
        license=None if named == "unknown" else named,
        attribution=said.get("attribution") or said.get("author") or attribution,
        files=tuple(sorted(layers.files)),
        missing_files=tuple(sorted(layers.missing)),
        remarks=tuple(source.findings),
        joints=chosen.joints,
        partial=chosen.partial,
        articulation=articulation,
    )


def _articulation(
    chosen: StageSelection,
    moving: LinkTree,
    seen: Sequence[Seen],
    felt: Sequence[Felt],
    units: StageUnits,
    source: MeshSource,
) -> tuple[Inertial, Articulation]:
    """Return the inertial of the whole, unknown if that of a body is unknown, and its links and joints."""
    solid = {chosen.node_of(placed) for _, placed in (*seen, *felt)}
    of_node: list[list[PlacedPrim]] = [[] for _ in chosen.bodies]
    for each in chosen.placed:
        node = chosen.node_of(each)
        if chosen.bodies[node] is not None or node in solid:  # a ground that is not read has no mass
            of_node[node].append(each)
    felt_of: list[list[Felt]] = [[] for _ in chosen.bodies]
    for shape in felt:
        felt_of[chosen.node_of(shape[1])].append(shape)
    weighed = [
        complete_from_hulls(declared_inertial(prims, shapes, units, source), shapes)
        for prims, shapes in zip(of_node, felt_of, strict=True)
    ]
    links = []
    for place, head in enumerate(moving.heads):
        mine = [node for node, link in enumerate(moving.link_of) if link == place]
        bodies = [weighed[node] for node in mine if felt_of[node] or weighed[node].mass_kg is not None]
        # static prims without visible shapes do not form a body of the file
        named = head if chosen.bodies[head] is not None else next(node for node in mine if chosen.nodes[node].shaped)
        links.append(AssetLink(chosen.nodes[named].name, _combine_bodies(bodies)))
    unweighed = [link.name for link in links if link.inertial.mass_kg is None]
    if unweighed and len(unweighed) < len(links):
        source.add_finding(f"link {unweighed[0]!r} declares no mass: that of all of it is not known")
    owners = tuple(moving.link_of[chosen.node_of(placed)] for _, placed in seen)
    return _combine_bodies([link.inertial for link in links]), Articulation(tuple(links), moving.joints, owners)


def _combine_bodies(bodies: list[Inertial]) -> Inertial:
    """Combine bodies into one inertial; empty if the mass of one is unknown."""
    if not bodies or any(body.mass_kg is None for body in bodies):
        return Inertial()
    return replace(combined_inertial(bodies), computed=any(body.computed for body in bodies))


def _empty_stage_clause(layers: LayerFiles) -> str:
    """Return a clause on what the stage has instead of shapes."""
    if layers.missing:
        return f", and layers that it names are not there: {', '.join(sorted(layers.missing)[:3])}"
    return "; it may be a layer of another asset"


def _custom_texts(stage: Usd.Stage, root: Usd.Prim) -> dict[str, str]:
    """Return the texts in the custom data of the root layer and default prim, and one level below; the prim has priority."""
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


def _remark_bodies(chosen: StageSelection, source: MeshSource) -> None:
    prims = {each.prim.GetPath(): each.prim for each in chosen.placed}.values()
    rigid = [prim for prim in prims if is_rigid_body(prim)]
    if not rigid:
        source.add_finding("no prim of it is a rigid body")
    if len(rigid) > 1 and chosen.moving is None:
        source.add_finding(f"its {len(rigid)} rigid bodies were taken as one")
    if any(UsdPhysics.RigidBodyAPI(prim).GetKinematicEnabledAttr().Get() for prim in rigid):
        source.add_finding("its rigid body is kinematic: it moves only where it is moved")
    if chosen.whole and any(joint.kind != "fixed" for joint in chosen.joints):
        source.add_finding("it has joints, which were left out")
