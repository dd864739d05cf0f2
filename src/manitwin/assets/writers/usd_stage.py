"""USD stage of a twin in memory: metres, Z up, one rigid body or an articulation, with every number written explicitly."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.simready import define_grasp_lines, describe_asset, label_prims
from manitwin.assets.writers.usd_bodies import define_links, define_rigid_twin
from manitwin.assets.writers.usd_materials import GlbImages, PreviewMaterials
from manitwin.twin.record_values import Estimate

CANNOT_SAY = (
    "USD has no rule for how the frictions of two bodies are combined: the simulator's own is used "
    "(PhysX: average, unless physxMaterial:frictionCombineMode says otherwise)",
    "USD keeps single precision: vertices, mass and inertia are rounded to 7 digits",
    "points and placements have no place in UsdPhysics: they stay in twin.json; the intervals and sources of mass and friction "
    "are in the default prim's customData, under 'manitwin'",
    "of the grasps that held the best and most different, 32 at most, are lines between the fingertips below 'grasps', without "
    "approach and depth: all are in grasps.parquet",
)
OF_JOINTS = (
    "UsdPhysics has no friction of a joint, and PhysX a share of the force that holds it: mjc:frictionloss and newton:friction "
    "have it in N m or N",
    "a drive without stiffness is the damping of a joint, and its greatest force the effort: set a stiffness to drive it",
)
"""Limitations for an articulated twin, in addition to ``CANNOT_SAY``."""


def build_stage(twin: TwinContent) -> tuple[Usd.Stage, dict[str, bytes]]:
    """Return the stage and its texture files, keyed by their path relative to the stage.

    The default prim is the rigid body: an Xform of kind component with ``visual``, ``collision`` and ``materials`` below it.
    For a twin with links it is an articulation, with a body for each link below ``links``, and ``joints``. It contains no
    physics scene, which belongs to the scene that references it.

    Source: USD Physics schema; AOUSD guidelines for asset structure.
    """
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    path = Sdf.Path.absoluteRootPath.AppendChild(twin.name)
    body = UsdGeom.Xform.Define(stage, path)
    root = body.GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind(Kind.Tokens.component)
    _describe(stage, root, twin)
    body.AddTranslateOp().Set(Gf.Vec3d(0, 0, 0))
    body.AddOrientOp().Set(Gf.Quatf(1, 0, 0, 0))
    body.AddScaleOp().Set(Gf.Vec3f(1, 1, 1))
    UsdGeom.Scope.Define(stage, path.AppendChild("materials"))
    materials = PreviewMaterials(stage, path.AppendPath("materials"), GlbImages(twin.visual_glb))
    friction = define_physics_material(stage, path.AppendPath("materials/physics"), twin)
    define = define_links if twin.record.links else define_rigid_twin
    define(stage, path, twin, materials, friction)
    define_grasp_lines(stage, path.AppendChild("grasps"), twin)
    label_prims(stage, root, twin)
    describe_asset(stage, twin)
    return stage, materials.textures


def crate(layer: Sdf.Layer) -> bytes:
    """Return a layer in USD's binary form, which the library writes only to files."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "layer.usdc"
        layer.Export(str(file))
        return file.read_bytes()


def _describe(stage: Usd.Stage, root: Usd.Prim, twin: TwinContent) -> None:
    """Write identity, origin and uncertainties of the twin to the stage and the root prim."""
    record, physical, language = twin.record, twin.physical, twin.record.language
    caption = language.caption if language is not None else record.name or "an object"
    credit = f"; {record.source.attribution}" if record.source.attribution else ""
    origin = f"Source: {record.source.file} ({record.source.kind}), licence {record.source.license}{credit}."
    stage.GetRootLayer().documentation = f"{caption} {origin} Twin {record.twin_id}, revision {record.revision}."
    root.SetDocumentation(f"{caption} Metres, +Z up, standing on z = 0; the origin is at the bottom centre.")
    Usd.ModelAPI(root).SetAssetName(twin.name)
    Usd.ModelAPI(root).SetAssetVersion(record.revision)
    said: dict[str, Any] = {
        "twin_id": record.twin_id,
        "revision": record.revision,
        "manitwin_version": record.provenance.manitwin_version,
        "source": {"kind": record.source.kind, "file": record.source.file, "sha256": record.source.sha256},
        "license": record.source.license,
        "attribution": record.source.attribution or "",
        "material": physical.material,
        "mass_distribution": physical.mass_distribution,
        "density_kg_m3": physical.density_kg_m3,
        "mass_kg": _interval(physical.mass_kg),
        "friction_static": _interval(physical.friction_static),
        "friction_dynamic": _interval(physical.friction_dynamic),
        "restitution": _interval(physical.restitution),
    }
    if language is not None:
        said |= {"category": language.category, "caption": language.caption}
    root.SetCustomDataByKey("manitwin", said)


def _interval(estimate: Estimate) -> dict[str, Any]:
    return {"value": estimate.value, "low": estimate.low, "high": estimate.high, "source": estimate.source}


def define_physics_material(stage: Usd.Stage, path: Sdf.Path, twin: TwinContent) -> UsdShade.Material:
    """Define friction and restitution of the surface, without density, because the mass is stated."""
    material = UsdShade.Material.Define(stage, path)
    surface = UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    surface.CreateStaticFrictionAttr(twin.physical.friction_static.value)
    surface.CreateDynamicFrictionAttr(twin.physical.friction_dynamic.value)
    surface.CreateRestitutionAttr(twin.physical.restitution.value)
    return material
