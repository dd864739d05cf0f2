"""Links and joints of USD stages: those of the same thing in URDF and MJCF, and where USD's own reading of joints has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from articulated_assets import ASSETS, write_assets
from articulated_usd import motions_of, write_usd
from manitwin.api import import_assets
from manitwin.assets.articulation import Articulation
from manitwin.assets.asset import Asset
from manitwin.assets.read import read_asset
from manitwin.assets.readers.usd import read_here
from manitwin.geometry.articulation import link_motions
from manitwin.geometry.poses import transform_points

NAMES = [Path(name).stem for name in ASSETS]
WAYS = {
    "plain": {},
    "centimetres and grams": {"unit_m": 0.01, "unit_kg": 0.001, "axis": "Z", "seed": 1},
    "nested bodies": {"nested": True, "axis": "Y", "seed": 2},
    "children first": {"backward": True, "seed": 3},
}


def keep(path: Path) -> Asset:
    return read_here(path, joints="keep")


def whole(asset: Asset) -> Articulation:
    assert asset.articulation is not None, asset.remarks
    return asset.articulation


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", NAMES)
def test_a_stage_gives_the_links_and_joints_that_urdf_and_mjcf_give(tmp_path: Path, name: str, way: str) -> None:
    given = read_asset(write_assets(tmp_path)[name], joints="keep")
    write_usd(given, tmp_path / "thing.usda", **WAYS[way])
    asset = keep(tmp_path / "thing.usda")
    theirs, ours = whole(given), whole(asset)
    assert [link.name for link in ours.links] == [link.name for link in theirs.links]
    assert ours.link_of_visual == theirs.link_of_visual
    for mine, other in zip(asset.visual, given.visual, strict=True):
        np.testing.assert_allclose(np.sort(mine.triangles_center, 0), np.sort(other.triangles_center, 0), atol=1e-6)
    for link, other in zip(ours.links, theirs.links, strict=True):
        assert link.inertial.mass_kg == pytest.approx(other.inertial.mass_kg)
        np.testing.assert_allclose(link.inertial.center_of_mass_m, other.inertial.center_of_mass_m, atol=1e-6)
        np.testing.assert_allclose(link.inertial.inertia_kg_m2, other.inertial.inertia_kg_m2, atol=1e-9)
    assert asset.inertial.mass_kg == pytest.approx(given.inertial.mass_kg)
    for joint, other in zip(ours.joints, theirs.joints, strict=True):
        assert (joint.name, joint.kind, joint.parent, joint.child) == (
            other.name,
            other.kind,
            other.parent,
            other.child,
        )
        assert (joint.lower, joint.upper) == pytest.approx((other.lower, other.upper), abs=1e-6)
        assert (joint.stands_at, joint.damping) == pytest.approx((other.stands_at, other.damping), abs=1e-6)
        assert joint.effort == pytest.approx(other.effort)
        np.testing.assert_allclose(joint.axis, other.axis, atol=1e-6)
        apart = joint.origin_m - other.origin_m
        apart -= (apart @ joint.axis) * joint.axis
        assert joint.kind == "prismatic" or np.linalg.norm(apart) < 1e-6
    assert not [remark for remark in asset.remarks if "joint" in remark]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_links_move_as_usds_own_reading_of_joints_has_it(tmp_path: Path, name: str, share: float) -> None:
    """The frames and bodies that UsdPhysics parses, in a chain of our own: second body = first frame, way, second frame."""
    given = read_asset(write_assets(tmp_path)[name], joints="keep")
    stage = write_usd(given, tmp_path / "thing.usda", unit_m=0.01, axis="Y", seed=5)
    asset = keep(tmp_path / "thing.usda")
    found = whole(asset)
    ways = [(1 - share) * (joint.lower or 0) + share * (joint.upper or 0) for joint in found.joints]
    motions = link_motions(found.joints, ways)
    named = {joint.name: way for joint, way in zip(found.joints, ways, strict=True)}
    theirs = {path.name: motion for path, motion in motions_of(stage, named).items()}
    for link, motion in zip(found.links[1:], motions[1:], strict=True):
        center = np.asarray(link.inertial.center_of_mass_m)
        expected = transform_points(theirs[link.name], center[None])[0]
        np.testing.assert_allclose(transform_points(motion, center[None])[0], expected, atol=1e-6)


def test_an_import_keeps_the_links_of_a_stage(tmp_path: Path) -> None:
    given = read_asset(write_assets(tmp_path / "given")["lidded_box"], joints="keep")
    write_usd(given, tmp_path / "lidded_box.usda", unit_m=0.01)
    (done,) = import_assets(tmp_path / "lidded_box.usda", tmp_path / "imported")
    assert done.folder is not None and done.record is not None and done.record.articulation is not None
    said = done.record.articulation
    assert [(link.name, link.mass_kg) for link in said.links] == [("box", 0.3), ("lid", 0.1)]
    (hinge,) = said.joints
    assert (hinge.lower, hinge.upper, hinge.locked_at) == pytest.approx((0.0, 1.9, 0.0), abs=1e-6)
    assert hinge.origin_m[1:] == pytest.approx([0.05, 0.08], abs=1e-6) and hinge.axis == pytest.approx(
        [-1, 0, 0], abs=1e-6
    )
    assert said.link_of_mesh == [0] * 5 + [1] * 2
