"""Export of a layout as a USD folder: a stage that references the exports of its twins, each stored once.

Source: USD Physics schema (PhysicsScene, CollisionAPI), UsdLux DistantLight, UsdGeom Camera.
"""

from __future__ import annotations

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdPhysics, UsdShade

from manitwin.assets.writers import usd
from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.usd_stage import CANNOT_SAY
from manitwin.geometry.poses import quaternion_wxyz, rotation_between
from manitwin.geometry.rigid_body import FURNITURE_FRICTION
from manitwin.physics.trial import GRAVITY_M_S2
from manitwin.scenes.layouts.surroundings import camera_axes
from manitwin.scenes.loaded_scene import Scene
from manitwin.scenes.sapien_scene import PLAIN_COLORS
from manitwin.scenes.scene import SceneCamera, SurfaceBox

MAIN = "scene.usda"
TWINS = "twins"
APERTURE_MM = 24.0  # vertical, of a full-frame camera; determines the angle of view with the focal length


def export_usd(scene: Scene) -> Exported:
    """Return the scene's stage with its twins; an articulated twin becomes one rigid body in its present pose.

    Raises ExportError for a twin that USD cannot represent.
    """
    record = scene.record
    layer = Sdf.Layer.CreateAnonymous(".usda")  # kept alive here, because a stage's own layer is released with it
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    root = Sdf.Path("/scene")
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, root).GetPrim())
    physics = UsdPhysics.Scene.Define(stage, root.AppendChild("physics"))
    physics.CreateGravityDirectionAttr(Gf.Vec3f(0, 0, -1))
    physics.CreateGravityMagnitudeAttr(GRAVITY_M_S2)
    _add_furniture(stage, root, record.furniture.boxes)
    files: dict[str, bytes] = {}
    known: dict[str, str] = {}
    references: dict[Sdf.Path, str] = {}
    UsdGeom.Scope.Define(stage, root.AppendChild("objects"))
    for placed in record.objects:
        if placed.twin_id not in known:
            content = TwinContent.of(scene.twin(placed.twin_id))
            exported = usd.export(content.as_one_body())
            folder = f"{TWINS}/{content.name}"
            files |= {f"{folder}/{name}": data for name, data in exported.files.items()}
            known[placed.twin_id] = f"./{folder}/{exported.main}"
        prim = stage.DefinePrim(root.AppendPath(f"objects/{placed.name}"))
        references[prim.GetPath()] = known[placed.twin_id]
        # overrides the twin's own values, while its order of operations stays
        prim.CreateAttribute("xformOp:translate", Sdf.ValueTypeNames.Double3, False).Set(Gf.Vec3d(*placed.position_m))
        prim.CreateAttribute("xformOp:orient", Sdf.ValueTypeNames.Quatf, False).Set(Gf.Quatf(*placed.quaternion_wxyz))
    _add_lights(stage, root, scene)
    for camera in record.cameras:
        _add_camera(stage, root, camera)
    del stage  # it would look up the twins, which are not on disk yet
    for path, asset in references.items():
        layer.GetPrimAtPath(path).referenceList.Prepend(Sdf.Reference(asset))
    files[MAIN] = layer.ExportToString().encode()
    return Exported(files=files, main=MAIN, cannot_say=CANNOT_SAY)


def _add_furniture(stage: Usd.Stage, root: Sdf.Path, boxes: tuple[SurfaceBox, ...]) -> None:
    scope = root.AppendChild("furniture")
    UsdGeom.Scope.Define(stage, scope)
    material = UsdShade.Material.Define(stage, scope.AppendChild("surface"))
    surface = UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    surface.CreateStaticFrictionAttr(FURNITURE_FRICTION)
    surface.CreateDynamicFrictionAttr(FURNITURE_FRICTION)
    surface.CreateRestitutionAttr(0.0)
    for box in boxes:
        cube = UsdGeom.Cube.Define(stage, scope.AppendChild(box.name))
        cube.CreateSizeAttr(2.0)
        cube.CreateExtentAttr([Gf.Vec3f(-1, -1, -1), Gf.Vec3f(1, 1, 1)])
        cube.CreateDisplayColorAttr([Gf.Vec3f(*PLAIN_COLORS[box.material])])
        cube.AddTranslateOp().Set(Gf.Vec3d(*box.center_m))
        cube.AddScaleOp().Set(Gf.Vec3f(*box.half_extents_m))
        UsdPhysics.CollisionAPI.Apply(cube.GetPrim())
        UsdShade.MaterialBindingAPI.Apply(cube.GetPrim()).Bind(material, materialPurpose="physics")


def _add_lights(stage: Usd.Stage, root: Sdf.Path, scene: Scene) -> None:
    scope = root.AppendChild("lights")
    UsdGeom.Scope.Define(stage, scope)
    dome = UsdLux.DomeLight.Define(stage, scope.AppendChild("ambient"))
    dome.CreateColorAttr(Gf.Vec3f(*scene.record.ambient))
    for number, light in enumerate(scene.record.lights):
        distant = UsdLux.DistantLight.Define(stage, scope.AppendChild(f"light_{number}"))
        strength = max(light.color)
        distant.CreateIntensityAttr(strength)
        distant.CreateColorAttr(Gf.Vec3f(*(c / strength for c in light.color)))
        UsdLux.ShadowAPI.Apply(distant.GetPrim()).CreateShadowEnableAttr(light.casts_shadow)
        turn = rotation_between(np.array([0.0, 0, -1]), np.array(light.direction))  # a distant light shines along -Z
        distant.AddOrientOp().Set(Gf.Quatf(*quaternion_wxyz(turn).tolist()))


def _add_camera(stage: Usd.Stage, root: Sdf.Path, camera: SceneCamera) -> None:
    right, up = camera_axes(camera.position_m, camera.target_m)
    turn = np.column_stack([right, up, np.cross(right, up)])  # looks along -Z, +Y up
    prim = UsdGeom.Camera.Define(stage, root.AppendChild(f"camera_{camera.name}"))
    prim.CreateVerticalApertureAttr(APERTURE_MM)
    prim.CreateHorizontalApertureAttr(APERTURE_MM)
    prim.CreateFocalLengthAttr(float(APERTURE_MM / 2 / np.tan(camera.fov_y_rad / 2)))
    prim.CreateClippingRangeAttr(Gf.Vec2f(0.01, 100.0))
    prim.AddTranslateOp().Set(Gf.Vec3d(*camera.position_m))
    prim.AddOrientOp().Set(Gf.Quatf(*quaternion_wxyz(turn).tolist()))
