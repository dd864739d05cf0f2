"""Content of NVIDIA's SimReady profile for rigid props beyond physics: labels, provenance, grasp lines and a thumbnail.

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
"""Distance from the finger contacts to the ends of a grasp line, so that a ray along it hits the surface from outside."""
THUMBNAIL_PX = 256


def describe_asset(stage: Usd.Stage, twin: TwinContent) -> None:
    """Write identity, source, size and mass of the asset to the custom data of the root layer."""
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
    """Return the twin's category, or else its name."""
    language = twin.record.language
    return language.category if language is not None else twin.record.name or "object"


def label_prims(stage: Usd.Stage, root: Usd.Prim, twin: TwinContent) -> None:
    """Label the body with its category and Wikidata item, and every material below it with the name of the material."""
    category = category_of(twin)
    _label(root, "class", category)
    _label(root, "wikidata_qcode", item_of(category))
    for prim in Usd.PrimRange(root):
        if prim.IsA(UsdShade.Material):
            _label(prim, "material", twin.physical.material)


def _label(prim: Usd.Prim, instance: str, value: str) -> None:
    UsdSemantics.LabelsAPI.Apply(prim, instance).CreateLabelsAttr().Set(Vt.TokenArray([value]))


def define_grasp_lines(stage: Usd.Stage, scope: Sdf.Path, twin: TwinContent) -> int:
    """Define a line for each of the best and most diverse held grasps of the first parallel gripper; return their number.

    A line runs along the closing direction through the point between the fingertips, from outside one contact to outside the
    other. It is a guide and is not rendered. Both its Xform and its curve have the name that readers look for.
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
    """Set one display colour for viewers without materials: the area-weighted mean of the surface, linear Rec. 709."""
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
    # the transfer function of IEC 61966-2-1 (sRGB)
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return np.asarray(linear.mean(0) * factor)


def thumbnail(twin: TwinContent, main: str) -> dict[str, bytes]:
    """Return the thumbnail of a file under the name that viewers look for; empty for a twin without a picture.

    The view is padded to a square with the colour of its corner pixel.
    """
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
