"""What NVIDIA's SimReady profile of a rigid prop asks of a stage besides its physics: labels, provenance, grasps, a thumbnail.

Source: SimReady Foundation 2026.8 (PyPI ``simready-foundation-tier-core``), profile Robotics-Prop 4.0.0: SL.001, SL.MAT.001,
SL.QCODE.001 (labels by UsdSemantics), SR.001, SR.002, SR.004 (metadata, thumbnail), GSP.001 (grasp lines), DISP.001.
"""

from __future__ import annotations

import io

import numpy as np
import trimesh
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSemantics, UsdShade, Vt

from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.grasp_rows import best_and_diverse, grasp_rows, parallel_gripper, parallel_grippers_of
from manitwin.assets.writers.wikidata_items import item_of
from manitwin.formats.meshes.textures import material_of

ASSET_TYPE = "Prop"
WITHOUT_DATE = "not recorded: equal twins give equal files"
MOST_GRASP_LINES = 32
BESIDE_PAD_M = 0.01
"""How far a grasp line begins outside of what the fingers touch: a ray along it then meets the surface from without."""
THUMBNAIL_PX = 256


def describe_asset(stage: Usd.Stage, twin: TwinContent) -> None:
    """Say what the asset is, where it is from and how large and heavy it is, in the root layer's custom data."""
    record, physical = twin.record, twin.physical
    category = category_of(twin)
    said = {
        "asset_name": twin.name,
        "asset_type": ASSET_TYPE,
        "source_file": record.source.file,
        "usd_date_generated": WITHOUT_DATE,
        "author": record.source.attribution or "unknown",
        "asset_license": record.source.license or "unknown",
        "category": category,
        "qcode": item_of(category),
        "rigid_body_count": max(len(record.links), 1),
        "asset_extents": Gf.Vec3f(*physical.extents_m),
        "mass": physical.mass_kg.value,
    }
    root = ("asset_name", "asset_type", "source_file", "usd_date_generated")
    stage.GetRootLayer().customLayerData = {"SimReady_Metadata": said, **{name: said[name] for name in root}}


def category_of(twin: TwinContent) -> str:
    """Return the twin's category, or what it was called."""
    language = twin.record.language
    return language.category if language is not None else twin.record.name or "object"


def label_prims(stage: Usd.Stage, root: Usd.Prim, twin: TwinContent) -> None:
    """Label the body with its category and Wikidata item, and every material below it with what it is made of."""
    category = category_of(twin)
    _label(root, "class", category)
    _label(root, "wikidata_qcode", item_of(category))
    for prim in Usd.PrimRange(root):
        if prim.IsA(UsdShade.Material):
            _label(prim, "material", twin.physical.material)


def _label(prim: Usd.Prim, instance: str, value: str) -> None:
    UsdSemantics.LabelsAPI.Apply(prim, instance).CreateLabelsAttr().Set(Vt.TokenArray([value]))


def define_grasp_lines(stage: Usd.Stage, scope: Sdf.Path, twin: TwinContent) -> int:
    """Define a line for each of the best and most different verified grasps of the first parallel gripper; returns how many.

    A line lies along the closing direction through the middle of the fingertips, from beside one to beside the other; it is
    a guide, not rendered. Its Xform and its curve both bear the name that readers look for.
    """
    grippers = parallel_grippers_of(twin)
    if not grippers:
        return 0
    rows = best_and_diverse(grasp_rows(twin, grippers[0], controls=False), MOST_GRASP_LINES)
    if not len(rows):
        return 0
    gripper = parallel_gripper(grippers[0])
    UsdGeom.Scope.Define(stage, scope).CreatePurposeAttr(UsdGeom.Tokens.guide)
    for number, (pose, width_m, depth_m) in enumerate(
        zip(rows.gripper_to_object, rows.width_m, rows.depth_m, strict=True)
    ):
        tip_m = gripper.tip_depth_m if gripper is not None else float(depth_m)
        half_m = float(width_m) / 2 + BESIDE_PAD_M
        ends = np.array([[half_m, 0, tip_m], [-half_m, 0, tip_m]]) @ pose[:3, :3].T + pose[:3, 3]
        name = f"grasp_identifier_{number:02d}"
        frame = UsdGeom.Xform.Define(stage, scope.AppendChild(name))
        line = UsdGeom.BasisCurves.Define(stage, frame.GetPath().AppendChild(f"{name}_line"))
        line.CreateTypeAttr(UsdGeom.Tokens.linear)
        line.CreateCurveVertexCountsAttr(Vt.IntArray([2]))
        line.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(ends.astype(np.float32)))
        line.CreateWidthsAttr(Vt.FloatArray([0.001]))
        line.SetWidthsInterpolation(UsdGeom.Tokens.constant)
        line.CreateExtentAttr(UsdGeom.Boundable.ComputeExtentFromPlugins(line, Usd.TimeCode.Default()))
        frame.GetPrim().SetCustomDataByKey("manitwin", {"grasp_id": rows.ids[number], "gripper": rows.gripper})
    return len(rows)


def set_display_color(scope: UsdGeom.Imageable, parts: tuple[trimesh.Trimesh, ...]) -> None:
    """Give all that is seen one colour for viewers without materials: the surface's mean, linear Rec. 709, by area."""
    areas = np.array([float(part.area) for part in parts])
    colors = np.array([_mean_color(part) for part in parts])
    mean = np.average(colors, axis=0, weights=areas if areas.sum() > 0 else None)
    primvar = UsdGeom.PrimvarsAPI(scope).CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, UsdGeom.Tokens.constant
    )
    primvar.Set(Vt.Vec3fArray([Gf.Vec3f(*np.clip(mean, 0, 1).tolist())]))


def _mean_color(part: trimesh.Trimesh) -> np.ndarray:
    material = material_of(part)
    factor = np.asarray(material.baseColorFactor, dtype=np.float64)[:3] / 255
    if material.baseColorTexture is None:
        return np.asarray(factor)
    small = material.baseColorTexture.convert("RGB").resize((32, 32), Image.Resampling.BOX)
    encoded = np.asarray(small, dtype=np.float64).reshape(-1, 3) / 255
    # IEC 61966-2-1 (sRGB), the transfer function
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return np.asarray(linear.mean(0) * factor)


def thumbnail(twin: TwinContent, main: str) -> dict[str, bytes]:
    """Return the thumbnail of a file by the name that viewers look for, a view on its own ground; empty without a view."""
    if twin.picture is None:
        return {}
    with Image.open(io.BytesIO(twin.picture)) as view:
        picture = view.convert("RGB")
    picture.thumbnail((THUMBNAIL_PX, THUMBNAIL_PX), Image.Resampling.LANCZOS)
    square = Image.new("RGB", (THUMBNAIL_PX, THUMBNAIL_PX), picture.getpixel((0, 0)))
    square.paste(picture, ((THUMBNAIL_PX - picture.width) // 2, (THUMBNAIL_PX - picture.height) // 2))
    stream = io.BytesIO()
    square.save(stream, "PNG")
    return {f".thumbs/256x256/{main}.png": stream.getvalue()}
