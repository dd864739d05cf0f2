"""Rules that hold matter against a shape leave room for hollows and for heads that are heavier than their handles."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from made_mug import DEPTH_M, clean, frame, scaled

from manitwin.assets.asset import AnnotatedFrame, Asset, Contact, Inertial
from manitwin.assets.audit.check import audit_asset
from manitwin.assets.audit.rules import RULES
from manitwin.geometry.poses import transform


def found(asset: Asset) -> set[str]:
    return {finding.code for finding in audit_asset(asset, RULES)}


def box(sides: tuple[float, float, float], x: float) -> trimesh.Trimesh:
    return trimesh.creation.box(sides, transform(translation=np.array([x, 0, 0])))


def test_a_frame_in_the_plane_of_an_opening_is_at_the_object() -> None:
    wide = scaled(replace(clean(), frames=()), 2)
    assert wide.name == "mug"
    at_the_rim, above = (
        AnnotatedFrame("functional", 0, transform(translation=np.array([0, 0, z]))) for z in (0.2 + 1e-6, 0.4)
    )
    assert "FRM005" not in found(replace(wide, frames=(at_the_rim,))), "75 mm from the wall, a hair above the hull"
    assert "FRM005" in found(replace(wide, frames=(above,)))


def test_fingers_around_a_mug_have_its_hollow_between_them() -> None:
    around = frame(np.array([0, 0, -1.0]), np.array([0, 1.0, 0]), np.array([0, 0, 0.08 + DEPTH_M]))
    beside = transform(translation=np.array([0.3, 0, 0])) @ around
    mug = clean()
    for pose, codes in ((around, set()), (beside, {"GRA006"})):
        poses = np.repeat(pose[None], 8, axis=0)
        grasps = replace(mug.grasps[0], gripper_to_asset=poses, width_m=np.full(8, 0.08))
        assert found(replace(mug, grasps=(grasps,))) & {"GRA006"} == codes


def test_a_heavy_head_leaves_little_inertia_about_a_centre_that_is_in_it() -> None:
    handle, head = box((0.3, 0.03, 0.03), 0.0), box((0.05, 0.12, 0.04), 0.175)
    both = trimesh.util.concatenate([handle, head])
    masses = np.array([500 * handle.volume, 7850 * head.volume])
    center = masses @ [handle.center_mass, head.center_mass] / masses.sum()
    inertia = np.zeros((3, 3))
    for mesh, mass in zip((handle, head), masses, strict=True):
        arm = mesh.center_mass - center
        own = mesh.moment_inertia / mesh.volume
        inertia += mass * (own + (arm @ arm) * np.eye(3) - np.outer(arm, arm))
    hammer = replace(
        clean(),
        name="thing",
        visual=(both,),
        collision=(),
        frames=(),
        grasps=(),
        rests=(),
        inertial=Inertial(float(masses.sum()), center, inertia),
    )
    assert "INE005" not in found(hammer)
    assert "INE005" in found(replace(hammer, inertial=replace(hammer.inertial, inertia_kg_m2=inertia / 10)))
    even = replace(hammer.inertial, center_of_mass_m=both.bounds.mean(0))
    assert "INE005" in found(replace(hammer, inertial=even)), "about a centre in its middle it is too little"


@pytest.mark.parametrize(
    ("name", "mass_kg", "wrong"),
    [("dumbbell", 2.0, False), ("dumbbell", 7.0, True), ("dumbbell", 0.0005, True), ("eraser", 2.0, True)],
)
def test_a_coat_of_rubber_says_nothing_of_the_iron_within(name: str, mass_kg: float, wrong: bool) -> None:
    heads = (box((0.06, 0.06, 0.06), x) for x in (-0.07, 0.07))
    shape = trimesh.util.concatenate([*heads, box((0.08, 0.03, 0.03), 0.0)])
    hull_m3 = shape.convex_hull.volume
    assert 2000 < 2.0 / hull_m3 < 7400 < 7.0 / hull_m3 / 1.25
    thing = replace(
        clean(), name=name, category=name, visual=(shape,), collision=(), frames=(), grasps=(), rests=(),
        inertial=Inertial(mass_kg, None, None), contact=Contact(0.7, 0.6, 0.5, "rubber"),
    )  # fmt: skip
    assert ("MAS003" in found(thing)) == wrong


@pytest.mark.parametrize(
    ("factor", "said", "end"),
    [(20.0, r"up to ([\d.e+]+) times the most$", -1), (0.1, r"down to ([\d.e-]+) of the least$", 0)],
)
def test_inertia_is_as_many_times_off_as_its_bounds_say(factor: float, said: str, end: int) -> None:
    solid = trimesh.creation.box((0.1, 0.06, 0.04))
    inertial = Inertial(0.3, np.zeros(3), factor * 0.3 * solid.moment_inertia / solid.volume)
    block = replace(clean(), name="thing", visual=(solid,), collision=(), frames=(), grasps=(), inertial=inertial)
    finding = next(each for each in audit_asset(block, RULES) if each.code == "INE005")
    moments, bound = (np.array(finding.values[key]) for key in ("principal_kg_m2", ("low_kg_m2", "high_kg_m2")[end]))
    told = re.search(said, finding.message)
    worst = (moments / bound).max() if factor > 1 else (moments / bound).min()
    assert told is not None and float(told[1]) == pytest.approx(worst, rel=0.06)


@pytest.mark.parametrize(("lift_m", "forgotten"), [(0.005, True), (0.002, False)])
def test_a_centre_at_the_surface_of_a_flat_thing_is_a_forgotten_one(lift_m: float, forgotten: bool) -> None:
    solid = trimesh.creation.box((0.12, 0.2, 0.01), transform(translation=np.array([0, 0, lift_m])))
    inertial = Inertial(0.5, np.zeros(3), 0.5 * solid.moment_inertia / solid.volume)
    tablet = replace(clean(), name="thing", visual=(solid,), collision=(), frames=(), grasps=(), inertial=inertial)
    assert ("COM003" in found(tablet)) == forgotten
