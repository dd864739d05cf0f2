"""Friction as Drake's own elements say it: numbers known in advance."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.assets.read import read_asset
from manitwin.errors import AssetError

URDF = """<robot name="cup" xmlns:drake="http://drake.mit.edu"><link name="l">
 <visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>
 <collision><geometry><box size="0.1 0.1 0.1"/></geometry>
  <drake:proximity_properties><drake:rigid_hydroelastic/>{said}</drake:proximity_properties></collision>
 <contact><lateral_friction value="0.9"/></contact>
</link></robot>"""
SDF = """<sdf version="1.7" xmlns:drake="http://drake.mit.edu"><model name="cup"><link name="l">
 <visual name="v"><geometry><box><size>0.1 0.1 0.1</size></box></geometry></visual>
 <collision name="a"><geometry><box><size>0.1 0.1 0.1</size></box></geometry>
  <surface><friction><ode><mu>0.9</mu></ode></friction></surface>
  <drake:proximity_properties><drake:mu_dynamic>0.3</drake:mu_dynamic><drake:mu_static>0.4</drake:mu_static>
  </drake:proximity_properties></collision>
 <collision name="b"><geometry><box><size>0.1 0.1 0.1</size></box></geometry>
  <drake:proximity_properties><drake:mu_dynamic>{second}</drake:mu_dynamic></drake:proximity_properties></collision>
</link></model></sdf>"""


@pytest.mark.parametrize(
    ("said", "static", "dynamic"),
    [
        ('<drake:mu_dynamic value="0.5"/>', 0.5, 0.5),
        ('<drake:mu_static value="0.7"/><drake:mu_dynamic value="0.5"/>', 0.7, 0.5),
        ("", 0.9, 0.9),
    ],
)
def test_urdf_has_drakes_friction_before_others(tmp_path: Path, said: str, static: float, dynamic: float) -> None:
    (tmp_path / "cup.urdf").write_text(URDF.format(said=said))
    contact = read_asset(tmp_path / "cup.urdf").contact
    assert (contact.friction_static, contact.friction_dynamic) == (static, dynamic)


@pytest.mark.parametrize(("second", "spread"), [("0.3", (0.3, 0.4)), ("0.4", None), ("0.6", (0.4, 0.6))])
def test_sdf_has_that_of_the_first_collision_and_the_range_where_others_differ(
    tmp_path: Path, second: str, spread: tuple[float, float] | None
) -> None:
    (tmp_path / "cup.sdf").write_text(SDF.format(second=second))
    asset = read_asset(tmp_path / "cup.sdf")
    assert (asset.contact.friction_static, asset.contact.friction_dynamic) == (0.4, 0.3)
    assert asset.contact.friction_range == spread
    told = [remark for remark in asset.remarks if remark.startswith("its collisions have frictions")]
    low, high = spread or (0.0, 0.0)
    assert told == (
        []
        if spread is None
        else [f"its collisions have frictions from {low} to {high}; a twin has one: the first, between these"]
    )


def test_what_is_no_number_is_named(tmp_path: Path) -> None:
    (tmp_path / "cup.urdf").write_text(URDF.format(said='<drake:mu_static value="much"/>'))
    with pytest.raises(AssetError, match=r"cup\.urdf: mu_static: 'much' is no number"):
        read_asset(tmp_path / "cup.urdf")
