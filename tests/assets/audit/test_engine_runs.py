"""What only running shows: each RUN rule fires on a mug that is broken in its way, and none on the mug as it is."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
import trimesh
from made_mug import clean

from manitwin.assets.asset import Asset, CollisionShape
from manitwin.assets.audit.ball_runs import drop_balls
from manitwin.assets.audit.check import audit_asset
from manitwin.assets.audit.finding import Finding
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules import RULES
from manitwin.assets.audit.run import ENGINES, audit_assets
from manitwin.errors import UsageError
from manitwin.formats.meshes.textures import bake_transform
from manitwin.geometry.poses import rotation_between, transform

RUNNING = [rule for rule in RULES if rule.code.startswith("RUN")]
INSTALLED = [engine for engine in ENGINES if find_spec(engine) is not None]


def mug(**inertial: object) -> Asset:
    """The mug with other mass properties."""
    asset = clean()
    return replace(asset, inertial=replace(asset.inertial, **inertial))  # type: ignore[arg-type]


def beside(offset_m: float) -> Asset:
    """The mug, its centre of mass so far from the axis; its foot has a radius of 40 mm."""
    center = clean().inertial.center_of_mass_m
    assert center is not None
    return mug(center_of_mass_m=center * [0, 0, 1] + [0, offset_m, 0])


def light(factor: float) -> Asset:
    """The mug with its inertia multiplied, and its mass as it is."""
    inertia = clean().inertial.inertia_kg_m2
    assert inertia is not None
    return mug(inertia_kg_m2=inertia * factor)


def found(asset: Asset, *engines: str) -> list[Finding]:
    return audit_asset(asset, RUNNING, engines)


@pytest.mark.parametrize("engine", INSTALLED)
def test_sound_mug_rests_in_every_engine(engine: str) -> None:
    assert found(clean(), engine) == []


def test_without_engines_nothing_is_run() -> None:
    assert found(mug(mass_kg=None)) == []


@pytest.mark.parametrize("missing", ["mass_kg", "center_of_mass_m", "inertia_kg_m2"])
def test_what_declares_too_little_is_not_run_and_says_so(missing: str) -> None:
    (finding,) = found(mug(**{missing: None}), "mujoco")
    assert (finding.code, finding.severity) == ("RUN001", "note") and "it declares no" in finding.message


def test_body_that_an_engine_refuses_is_told_in_its_words() -> None:
    (finding,) = found(light(1e-20), "mujoco")
    assert finding.code == "RUN002" and "must be larger than mjMINVAL" in finding.message


def test_inertia_far_too_small_throws_the_body_off_the_plane() -> None:
    (finding,) = found(light(1e-6), "sapien")
    assert (finding.code, finding.severity) == ("RUN003", "error")
    assert finding.values is not None and abs(finding.values["lowest_m"]) > 0.05


@pytest.mark.slow
def test_centre_of_mass_over_the_edge_of_the_foot_is_another_thing_in_each_engine_and_at_each_step() -> None:
    offsets = np.arange(0.0370, 0.0400, 0.0005)
    codes = [{finding.code for finding in found(beside(offset), "mujoco", "sapien")} for offset in offsets]
    assert any("RUN006" in each for each in codes) and any("RUN005" in each for each in codes)
    assert not any({"RUN005", "RUN006"} <= each for each in codes), "one cause is one finding"


def test_what_tips_over_everywhere_is_noted() -> None:
    findings = found(beside(0.045), "mujoco", "sapien")
    assert [finding.severity for finding in findings if finding.code == "RUN007"] == ["note"]


def test_engine_that_is_not_known_or_not_there_is_wrong_use(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UsageError, match="valid are mujoco, sapien, pybullet"):
        audit_assets(["."], engines=["gazebo"])
    monkeypatch.setattr("manitwin.assets.audit.run.find_spec", lambda name: None)
    with pytest.raises(UsageError, match="pip install pybullet"):
        audit_assets(["."], engines=["pybullet"])


@pytest.mark.parametrize("engine", INSTALLED)
def test_a_lid_that_nobody_sees_keeps_a_ball_out(engine: str) -> None:
    asset = clean()
    high = asset.visual[0].bounds[1]
    lid = trimesh.creation.cylinder(
        0.04, 0.002, transform=trimesh.transformations.translation_matrix([0, 0, high[2] - 0.001])
    )
    closed = replace(
        asset, collision=(*asset.collision, CollisionShape("lid", lid.vertices, lid.faces, True, primitive=True))
    )
    (finding,) = [each for each in found(closed, engine) if each.code == "RUN008"]
    assert finding.severity == "error" and engine in finding.message
    assert [each for each in found(asset, engine) if each.code == "RUN008"] == []


def test_an_opening_is_up_by_the_assets_own_axis() -> None:
    asset = clean()
    turn = rotation_between(np.array([0.0, 0, 1]), np.array([0.0, 1, 0]))
    turned = replace(
        asset,
        up="y",
        visual=tuple(bake_transform(part, transform(turn, np.zeros(3))) for part in asset.visual),
        collision=tuple(replace(shape, vertices=shape.vertices @ turn.T) for shape in asset.collision),
    )
    result = drop_balls(MeasuredAsset(turned, ("mujoco",)))
    assert result.opening is not None and result.inside == {"mujoco": True}
