"""What joints of USD stages hold and let go: two boxes and a joint of every kind, limit and end that a file may give it."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

from manitwin.assets.articulation import Articulation
from manitwin.assets.asset import Asset
from manitwin.assets.read import read_asset
from manitwin.assets.readers.usd import read_here
from manitwin.errors import AssetError

Make = Callable[[Usd.Stage], object]


def box(
    stage: Usd.Stage, name: str, at: tuple[float, float, float] = (0, 0, 0), *, mass_kg: float | None = 1.0
) -> Usd.Prim:
    """A rigid body of 0.1 x 0.2 x 0.3 m that collides."""
    body = UsdGeom.Xform.Define(stage, f"/thing/{name}")
    body.AddTranslateOp().Set(at)
    UsdPhysics.RigidBodyAPI.Apply(body.GetPrim())
    if mass_kg is not None:
        UsdPhysics.MassAPI.Apply(body.GetPrim()).CreateMassAttr(mass_kg)
    shape = UsdGeom.Cube.Define(stage, f"/thing/{name}/shape")
    shape.CreateSizeAttr(1.0)
    shape.AddScaleOp().Set((0.1, 0.2, 0.3))
    UsdPhysics.CollisionAPI.Apply(shape.GetPrim())
    return body.GetPrim()


def join(
    stage: Usd.Stage,
    kind: type = UsdPhysics.RevoluteJoint,
    ends: tuple[str | None, str | None] = ("body", "door"),
    name: str = "hinge",
    limits: tuple[float, float] | None = (0, 90),
    at: tuple[float, float, float] = (0, 0, 0),
) -> Usd.Prim:
    joint = kind.Define(stage, f"/thing/{name}")
    for end, relation in zip(ends, (joint.CreateBody0Rel(), joint.CreateBody1Rel()), strict=True):
        if end is not None:
            relation.SetTargets([f"/thing/{end}" if end else "/thing"])
    for end, place in enumerate(ends):
        prim = stage.GetPrimAtPath(f"/thing/{place}") if place else None
        origin = (
            prim.GetAttribute("xformOp:translate").Get()
            if prim and prim.HasAttribute("xformOp:translate")
            else (0, 0, 0)
        )
        getattr(joint, f"CreateLocalPos{end}Attr")(Gf.Vec3f(*(np.array(at) - np.array(origin)).tolist()))
    if limits is not None and kind in (UsdPhysics.RevoluteJoint, UsdPhysics.PrismaticJoint):
        joint.CreateLowerLimitAttr(limits[0])
        joint.CreateUpperLimitAttr(limits[1])
    return joint.GetPrim()


def made(folder: Path, *steps: Make, joints: str = "keep", two: bool = True) -> Asset:
    file = folder / "thing.usda"
    file.unlink(missing_ok=True)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(layer)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/thing").GetPrim())
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    UsdGeom.SetStageUpAxis(stage, "Z")
    if two:
        box(stage, "body", mass_kg=2.0)
        box(stage, "door", (0.5, 0, 0))
    for step in steps:
        step(stage)
    layer.Export(str(file))
    return read_here(file, joints=joints)  # type: ignore[arg-type]


def whole(asset: Asset) -> Articulation:
    assert asset.articulation is not None, asset.remarks
    return asset.articulation


def locked(asset: Asset) -> list[str]:
    assert asset.articulation is None and len(asset.visual) == 2 and asset.inertial.mass_kg == 3
    return [remark for remark in asset.remarks if "locked as the file stands" in remark]


def test_a_hinge_has_degrees_and_a_slide_the_stages_lengths(tmp_path: Path) -> None:
    def centimetres(stage: Usd.Stage) -> None:
        UsdGeom.SetStageMetersPerUnit(stage, 0.01)
        box(stage, "drawer", (0, 0, 50))
        join(stage, UsdPhysics.PrismaticJoint, ("body", "drawer"), "slide", (0, 40))
        join(stage)

    hinge, slide = sorted(whole(made(tmp_path, centimetres)).joints, key=lambda joint: joint.name)
    assert (hinge.kind, hinge.lower, hinge.upper) == ("revolute", 0, pytest.approx(math.pi / 2))
    assert (slide.kind, slide.lower, slide.upper) == ("prismatic", 0, pytest.approx(0.4))


@pytest.mark.parametrize(
    ("limits", "kept"),
    [
        (None, ("continuous", None, None)),
        ((-math.inf, math.inf), ("continuous", None, None)),
        ((-3.4028235e38, 3.4028235e38), ("continuous", None, None)),
        ((-30, 60), ("revolute", math.radians(-30), math.radians(60))),
        ((-math.inf, 60), ("continuous", None, None)),
    ],
)
def test_limits_that_are_none_let_it_turn_on_and_on(
    tmp_path: Path, limits: tuple[float, float] | None, kept: object
) -> None:
    asset = made(tmp_path, lambda stage: join(stage, limits=limits))
    (joint,) = whole(asset).joints
    assert (joint.kind, joint.lower, joint.upper) == pytest.approx(kept)
    assert any("has one limit" in remark for remark in asset.remarks) == (limits == (-math.inf, 60))


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (lambda s: join(s, UsdPhysics.SphericalJoint), "'hinge' is spherical, which twins do not have"),
        (lambda s: join(s, UsdPhysics.Joint), "'hinge' is free in 6 ways, which twins do not have"),
        (lambda s: join(s, limits=(30, 30)), "its limits leave it no way"),
        (lambda s: join(s, limits=(90, 0)), "its limits leave it no way"),
        (lambda s: join(s).CreateAttribute("physics:axis", Sdf.ValueTypeNames.Token).Set("W"), "its axis has no direction"),
        (lambda s: join(s).AddAppliedSchema("PhysxMimicJointAPI:rotX"), "copies another one (mimic)"),
        (lambda s: join(s).AddAppliedSchema("NewtonMimicAPI"), "copies another one (mimic)"),
    ],
)  # fmt: skip
def test_what_a_twin_cannot_have_is_locked_and_said(tmp_path: Path, make: Make, why: str) -> None:
    (remark,) = locked(made(tmp_path, make))
    assert why in remark


def test_a_joint_of_six_ways_that_leaves_one_is_a_hinge_or_a_slide(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        joint = join(stage, UsdPhysics.Joint)
        for way in ("transX", "transY", "transZ", "rotX", "rotZ"):
            limit = UsdPhysics.LimitAPI.Apply(joint, way)
            limit.CreateLowAttr(1.0)
            limit.CreateHighAttr(-1.0)
        limit = UsdPhysics.LimitAPI.Apply(joint, "rotY")
        limit.CreateLowAttr(-45.0)
        limit.CreateHighAttr(45.0)

    (joint,) = whole(made(tmp_path, make)).joints
    assert (joint.kind, joint.upper) == ("revolute", pytest.approx(math.pi / 4))
    np.testing.assert_allclose(joint.axis, [0, 1, 0], atol=1e-9)


def test_fixed_joints_make_one_link_and_alone_one_body(tmp_path: Path) -> None:
    def handle(stage: Usd.Stage) -> None:
        box(stage, "handle", (0.7, 0, 0), mass_kg=0.5)
        join(stage, UsdPhysics.FixedJoint, ("door", "handle"), "glue")

    found = whole(made(tmp_path, handle, join))
    assert [(link.name, link.inertial.mass_kg) for link in found.links] == [("body", 2), ("door", 1.5)]
    assert found.link_of_visual == (0, 1, 1)
    asset = made(tmp_path, lambda stage: join(stage, UsdPhysics.FixedJoint))
    assert asset.articulation is None and len(asset.visual) == 2 and not asset.partial


def test_a_joint_that_is_turned_off_or_ends_nowhere_is_left_out_and_said(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        join(stage)
        UsdPhysics.Joint(join(stage, name="off")).CreateJointEnabledAttr(False)
        join(stage, ends=("body", "gone"), name="lost")
        join(stage, ends=("body", "body"), name="self")
        join(stage, ends=(None, None), name="bare")
        UsdPhysics.Joint(join(stage, name="torn")).GetBody1Rel().SetTargets(["/thing/door", "/thing/body"])

    asset = made(tmp_path, make)
    assert [joint.name for joint in whole(asset).joints] == ["hinge"]
    said = " ".join(asset.remarks)
    for words in (
        "'off' is turned off (jointEnabled)", "'lost' names /thing/gone, which is not there",
        "'self' has both its ends on one thing", "'bare' joins no rigid body", "'torn' names several bodies for one of its ends",
    ):  # fmt: skip
        assert f"joint {words} and was left out" in said


def test_of_a_loop_the_joint_outside_the_articulation_is_left_out(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        box(stage, "arm", (0.5, 0, 0.5))
        join(stage, ends=("arm", "door"), name="closing")
        UsdPhysics.Joint(stage.GetPrimAtPath("/thing/closing")).CreateExcludeFromArticulationAttr(True)
        join(stage)
        join(stage, ends=("body", "arm"), name="shoulder")

    asset = made(tmp_path, make)
    assert [joint.name for joint in whole(asset).joints] == ["hinge", "shoulder"]
    assert "joint closing (revolute) closes a loop and was left out" in asset.remarks


def test_two_hinges_of_a_door_are_one_and_two_axes_of_a_body_none(tmp_path: Path) -> None:
    asset = made(tmp_path, join, lambda stage: join(stage, name="lower_hinge", at=(-0.2, 0, 0)))
    assert [joint.name for joint in whole(asset).joints] == ["hinge"]

    def cross(stage: Usd.Stage) -> None:
        UsdPhysics.RevoluteJoint(join(stage, name="second")).CreateAxisAttr("Y")

    (remark,) = locked(made(tmp_path, join, cross))
    assert "'hinge' is one of 2 between two bodies" in remark


def test_what_is_joined_to_nothing_is_left_out(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        join(stage)
        box(stage, "loose", (3, 0, 0))
        UsdGeom.Cube.Define(stage, "/thing/ground")

    asset = made(tmp_path, make)
    assert asset.partial and len(asset.visual) == 2 and asset.inertial.mass_kg == 3
    assert "body 'loose' is joined to nothing that moves and was left out: one rigid object is read" in asset.remarks
    assert "shape 'ground' is of no rigid body and was left out: one rigid object is read" in asset.remarks
    everything = made(tmp_path, make, joints="part")
    assert len(everything.visual) == 4 and "it has joints, which were left out" in everything.remarks


def test_joints_are_locked_where_that_is_asked_for(tmp_path: Path) -> None:
    made(tmp_path, join)
    asset = read_asset(tmp_path / "thing.usda", joints="lock")
    assert asset.articulation is None and len(asset.visual) == 2
    assert any("joints were locked" in remark and "hinge (revolute)" in remark for remark in asset.remarks)


def test_what_a_fixed_joint_stands_in_the_world_is_the_root_and_its_ground_is_not(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdGeom.Cube.Define(stage, "/thing/ground")
        join(stage, UsdPhysics.FixedJoint, (None, "door"), "stand")
        join(stage)

    found = whole(made(tmp_path, make))
    assert [link.name for link in found.links] == ["door", "body"]
    np.testing.assert_allclose(found.joints[0].axis, [-1, 0, 0], atol=1e-9)  # the hinge from its other side


@pytest.mark.parametrize("named", ["frame", None])
def test_doors_hang_from_what_stands_fast(tmp_path: Path, named: str | None) -> None:
    """A cupboard of no rigid body, which its hinge names or, leaving that end out, takes for the world."""

    def make(stage: Usd.Stage) -> None:
        UsdGeom.Xform.Define(stage, "/thing/frame")
        UsdGeom.Cube.Define(stage, "/thing/frame/side").CreateSizeAttr(0.4)
        box(stage, "door", (0.5, 0, 0))
        join(stage, ends=(named, "door"), at=(0.2, 0, 0))

    asset = made(tmp_path, make, two=False)
    found = whole(asset)
    assert [link.name for link in found.links] == [named or "world", "door"] and found.link_of_visual == (0, 1)
    np.testing.assert_allclose(found.joints[0].origin_m, [0.2, 0, 0], atol=1e-7)
    assert [link.inertial.mass_kg for link in found.links] == [None, 1]
    assert asset.inertial.mass_kg is None, "what stands fast weighs nobody knows what"


def test_a_body_that_is_turned_off_is_none(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath("/thing/body")).CreateRigidBodyEnabledAttr(False)
        join(stage)

    found = whole(made(tmp_path, make))
    assert [link.name for link in found.links] == ["body", "door"]
    assert found.joints[0].parent == 0, "what stands fast is the root"


def test_bodies_of_references_and_instances_are_joined(tmp_path: Path) -> None:
    """Joints inside of what is referenced name bodies in it; the root refers to it twice, once as an instance."""

    def make(stage: Usd.Stage) -> None:
        stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/world").GetPrim())
        join(stage)
        stage.GetPrimAtPath("/thing").SetActive(True)
        copy = UsdGeom.Xform.Define(stage, "/world/cupboard")
        copy.AddTranslateOp().Set((0, 0, 2))
        copy.GetPrim().GetReferences().AddInternalReference("/thing")
        copy.GetPrim().SetInstanceable(True)
        stage.GetPrimAtPath("/thing").SetSpecifier(Sdf.SpecifierClass)

    found = whole(made(tmp_path, make))
    assert [link.name for link in found.links] == ["body", "door"]
    np.testing.assert_allclose(found.joints[0].origin_m, [0, 0, 2], atol=1e-9)


def test_places_of_joints_follow_the_scale_of_their_bodies(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        for name in ("body", "door"):
            UsdGeom.Xformable(stage.GetPrimAtPath(f"/thing/{name}")).AddScaleOp().Set((2, 2, 2))
        joint = UsdPhysics.RevoluteJoint(join(stage, at=(0, 0, 0)))
        joint.GetLocalPos0Attr().Set((0.05, 0, 0))
        joint.GetLocalPos1Attr().Set((-0.2, 0, 0))

    asset = made(tmp_path, make)
    np.testing.assert_allclose(whole(asset).joints[0].origin_m, [0.1, 0, 0], atol=1e-7)
    assert not any("was moved" in remark for remark in asset.remarks)


def test_bodies_are_put_where_the_frames_of_a_joint_have_them(tmp_path: Path) -> None:
    """A door that is drawn beside its hinge, as in stages that leave it to the simulator to bring bodies together."""

    def make(stage: Usd.Stage) -> None:
        UsdPhysics.RevoluteJoint(join(stage, at=(0, 0, 0))).GetLocalPos1Attr().Set((-0.2, 0, 0))
        box(stage, "handle", (0.6, 0, 0))
        join(stage, ends=("door", "handle"), name="turn", at=(0.6, 0, 0))

    asset = made(tmp_path, make)
    found = whole(asset)
    assert [float(part.vertices[:, 0].mean()) for part in asset.visual] == pytest.approx([0, 0.2, 0.3])
    np.testing.assert_allclose(found.joints[1].origin_m, [0.3, 0, 0], atol=1e-7)
    assert any("'hinge' holds was moved by 300 mm and 0 degrees" in remark for remark in asset.remarks)


def test_a_joint_stands_within_its_limits(tmp_path: Path) -> None:
    asset = made(tmp_path, lambda stage: join(stage, limits=(90, 120)))
    (joint,) = whole(asset).joints
    assert joint.stands_at == pytest.approx(math.pi / 2)
    door = asset.visual[1].vertices
    assert np.ptp(door, axis=0) == pytest.approx([0.1, 0.3, 0.2], abs=1e-6), "turned by a quarter about X"


def test_what_drives_and_slows_a_joint(tmp_path: Path) -> None:
    def make(stage: Usd.Stage, stiffness: float = 0.0) -> None:
        prim = join(stage)
        drive = UsdPhysics.DriveAPI.Apply(prim, "angular")
        drive.CreateDampingAttr(0.01)
        drive.CreateStiffnessAttr(stiffness)
        drive.CreateMaxForceAttr(5.0)
        prim.CreateAttribute("physxJoint:maxJointVelocity", Sdf.ValueTypeNames.Float).Set(180.0)
        prim.CreateAttribute("mjc:frictionloss", Sdf.ValueTypeNames.Double).Set(0.2)

    asset = made(tmp_path, make)
    (joint,) = whole(asset).joints
    assert joint.damping == pytest.approx(0.01 * 180 / math.pi), "of a torque for each degree a second"
    assert (joint.friction, joint.effort, joint.velocity) == pytest.approx((0.2, 5.0, math.pi))
    assert not any("motors" in remark for remark in asset.remarks)
    driven = made(tmp_path, lambda stage: make(stage, 100.0))
    assert whole(driven).joints[0].damping == 0 and any("motors" in remark for remark in driven.remarks)


def test_a_mass_alone_has_centre_and_inertia_of_what_collides(tmp_path: Path) -> None:
    found = whole(made(tmp_path, join))
    door = found.links[1].inertial
    np.testing.assert_allclose(door.center_of_mass_m, [0.5, 0, 0], atol=1e-9)
    np.testing.assert_allclose(np.diag(door.inertia_kg_m2), np.array([0.13, 0.1, 0.05]) / 12, rtol=1e-6)
    assert door.computed


def test_a_link_without_a_mass_leaves_that_of_all_unknown(tmp_path: Path) -> None:
    asset = made(tmp_path, join, lambda stage: stage.GetPrimAtPath("/thing/door").RemoveAPI(UsdPhysics.MassAPI))
    assert asset.inertial.mass_kg is None
    assert "link 'door' declares no mass: that of all of it is not known" in asset.remarks


def test_nested_bodies_weigh_each_its_own(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        box(stage, "body/lid", (0, 0, 0.3), mass_kg=0.25)
        join(stage, ends=("body", "body/lid"), at=(0, 0, 0))
        stage.GetPrimAtPath("/thing/door").SetActive(False)

    for joints in ("keep", "part"):
        assert made(tmp_path, make, joints=joints).inertial.mass_kg == pytest.approx(2.25)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda j: UsdPhysics.RevoluteJoint(j).CreateLowerLimitAttr(math.nan),
        lambda j: UsdPhysics.RevoluteJoint(j).CreateLocalPos0Attr((math.nan, 0, 0)),
        lambda j: UsdPhysics.RevoluteJoint(j).CreateLocalPos1Attr((math.inf, 0, 0)),
        lambda j: UsdPhysics.RevoluteJoint(j).CreateLocalRot1Attr(Gf.Quatf(math.nan, 0, 0, 0)),
        lambda j: UsdPhysics.RevoluteJoint(j).CreateLocalPos1Attr((1e30, 0, 0)),
        lambda j: UsdPhysics.DriveAPI.Apply(j, "angular").CreateDampingAttr(math.nan),
        lambda j: j.CreateAttribute("mjc:damping", Sdf.ValueTypeNames.String).Set("much"),
        lambda j: j.CreateAttribute("physxJoint:armature", Sdf.ValueTypeNames.Float3).Set((1, 2, 3)),
    ],
)  # fmt: skip
def test_hostile_numbers_of_joints_are_errors_in_one_line(tmp_path: Path, spoil: Callable[[Usd.Prim], object]) -> None:
    with pytest.raises(AssetError) as raised:
        made(tmp_path, lambda stage: spoil(join(stage)))
    assert "\n" not in str(raised.value) and "thing.usda" in str(raised.value) and "; give " in str(raised.value)


def test_a_turn_of_no_length_is_none(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdPhysics.RevoluteJoint(join(stage)).CreateLocalRot0Attr(Gf.Quatf(0, 0, 0, 0))

    np.testing.assert_allclose(whole(made(tmp_path, make)).joints[0].axis, [1, 0, 0], atol=1e-9)


def test_circles_of_joints_are_cut_once(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        names = [f"link_{number}" for number in range(20)]
        for number, name in enumerate(names):
            box(stage, name, (0.2 * number, 0, 1))
        for number, name in enumerate(names):
            join(stage, ends=(name, names[number - 19]), name=f"joint_{number}")

    asset = made(tmp_path, make, two=False)
    assert len(whole(asset).links) == 20
    assert len([remark for remark in asset.remarks if "closes a loop" in remark]) == 1


def test_of_many_loops_the_first_are_named(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        for number in range(9):
            join(stage, name=f"hinge_{number}", at=(-0.1 * number, 0, 0))

    asset = made(tmp_path, make)
    assert len([remark for remark in asset.remarks if "closes a loop" in remark]) == 3
    assert "5 more joints close loops and were left out" in asset.remarks


def test_names_are_those_that_a_converter_could_not_write(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        join(stage).SetDisplayName("hinge.0")
        stage.GetPrimAtPath("/thing/door").SetDisplayName("front door")

    found = whole(made(tmp_path, make))
    assert [link.name for link in found.links] == ["body", "front door"] and found.joints[0].name == "hinge.0"


def test_what_converters_note_of_a_joint(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        prim = join(stage)
        for name, value in (("newton:velocityLimit", 90.0), ("newton:damping", 0.02), ("newton:friction", 0.3)):
            prim.CreateAttribute(name, Sdf.ValueTypeNames.Float).Set(value)
        prim.CreateAttribute("urdf:limit:effort", Sdf.ValueTypeNames.Float).Set(7.0)

    (joint,) = whole(made(tmp_path, make)).joints
    assert (joint.velocity, joint.friction, joint.effort) == pytest.approx((math.pi / 2, 0.3, 7.0))
    assert joint.damping == pytest.approx(0.02 * 180 / math.pi)


def test_a_body_that_shows_nothing_names_the_link_that_it_holds(tmp_path: Path) -> None:
    """As the first link of a URDF without a shape does."""

    def make(stage: Usd.Stage) -> None:
        UsdPhysics.RigidBodyAPI.Apply(UsdGeom.Xform.Define(stage, "/thing/base").GetPrim())
        join(stage, UsdPhysics.FixedJoint, ("base", "body"), "weld")
        join(stage)

    assert [link.name for link in whole(made(tmp_path, make)).links] == ["base", "door"]


def test_shapes_of_no_size_are_left_out(tmp_path: Path) -> None:
    def make(stage: Usd.Stage) -> None:
        UsdGeom.Sphere.Define(stage, "/thing/door/mark").CreateRadiusAttr(0.0)
        join(stage)

    asset = made(tmp_path, make)
    assert len(asset.visual) == 2 and "shapes of no size in it were left out" in asset.remarks


def test_a_ground_that_is_not_read_weighs_nothing(tmp_path: Path) -> None:
    """A body that hangs from the world, in which a plane of no rigid body declares a mass, as converters from MJCF write it."""

    def make(stage: Usd.Stage) -> None:
        UsdPhysics.MassAPI.Apply(UsdGeom.Plane.Define(stage, "/thing/floor").GetPrim()).CreateMassAttr(9.0)
        join(stage, ends=(None, "body"), name="slider")
        join(stage)

    found = whole(made(tmp_path, make))
    assert [(link.name, link.inertial.mass_kg) for link in found.links] == [("body", 2), ("door", 1)]
