"""MJCF that the MuJoCo of today refuses and older ones or other programs read."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from written_mjcf import mjcf, wedge

from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.rules import RULES
from manitwin.assets.read import read_asset
from manitwin.errors import AssetError


def test_what_programs_mend_before_mujoco_sees_it_is_read_and_said(tmp_path: Path) -> None:
    wedge().export(tmp_path / "wedge.stl")
    mesh = '<mesh name="w" file="wedge.stl" scale="0.01 0.01 0.01"/>'
    body = (
        '<body><joint damping="1e11"/><geom type="mesh" mesh="w" material="nowhere"/>'
        "<body><freejoint/><site/></body></body>".replace("<freejoint/>", '<joint type="slide"/>')
    )
    asset = read_asset(mjcf(tmp_path, body, f"<asset>{mesh}{mesh}</asset>"))
    assert len(asset.visual) == 1
    said = " ".join(asset.remarks)
    for words in ("written twice", "'nowhere' is nowhere written", "moves and has no mass"):
        assert words in said


DIALECTS = {
    "is called 'heavy'": (
        '<default class="heavy"><geom density="50"/><default class="light"><geom density="5"/></default></default>'
        '<default class="second"><geom size="0.2"/></default>',
        '<body><freejoint/><geom size="0.1" class="heavy"/><geom class="second"/><geom size="0.1" class="light"/></body>',
        4 / 3 * np.pi * (50 * 0.1**3 + 50 * 0.2**3 + 5 * 0.1**3),
    ),
    "the attribute 'group'": (
        '<default><default class="c" group="1"><geom size="0.1" mass="2"/></default></default>',
        '<body childclass="c"><freejoint/><geom/><site rgba="0.1 0.2 red 1"/></body>',
        2.0,
    ),
    "the type 'fixed'": (
        "",
        '<body><freejoint/><geom size="0.1" mass="1"/>'
        '<body pos="0 0 1"><joint type="fixed"/><geom size="0.1" mass="2"/></body></body>',
        3.0,
    ),
    "has fullinertia and quat": (
        "",
        '<body><freejoint/><geom size="0.1"/>'
        '<inertial pos="0 0 0" mass="2" quat="0.7 0.7 0 0" fullinertia="1 1 1 0 0 0"/></body>',
        2.0,
    ),
    "<region> is none of MJCF": (
        "",
        '<body><freejoint/><region size="1"/><geom size="0.1" mass="1" shine="2"/><region/></body>',
        1.0,
    ),
    "the attribute 'shine' of <geom>": (
        "",
        '<body><freejoint/><geom size="0.1" mass="1" shine="2" glow="3"/></body>',
        1.0,
    ),
    "the class 'gone' is nowhere": (
        "",
        '<body name="b" childclass="gone"><freejoint/><geom class="gone" size="0.1" mass="1"/></body>',
        1.0,
    ),
    "the world has an <inertial>": (
        "",
        '<inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/><body><freejoint/><geom size="0.1" mass="1"/></body>',
        1.0,
    ),
    "a plane has no size": (
        "",
        '<geom type="plane"/><body><freejoint/><geom size="0.1" mass="1"/></body>',
        1.0,
    ),
    "an <inertial> has no pos": (
        "",
        '<body><freejoint/><inertial mass="2" diaginertia="1 1 1"/><geom size="0.1"/></body>',
        2.0,
    ),
    "the material 'paint' is nowhere": (
        '<default><geom material="paint"/></default>',
        '<body><freejoint/><geom size="0.1" mass="1"/></body>',
        1.0,
    ),
    "are called 'g'": (
        "",
        '<body name="b"><freejoint/><geom name="g" size="0.1" mass="1"/><geom name="g" size="0.2" mass="2"/></body>',
        3.0,
    ),
    "'m' is written twice": (
        '<asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/><mesh name="m" vertex="0 0 0 9 0 0 0 9 0 0 0 9"/></asset>',
        '<body><freejoint/><geom type="mesh" mesh="m" density="6"/></body>',
        1.0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("said", DIALECTS)
def test_what_mujoco_of_today_refuses_is_read_as_older_ones_and_others_do(tmp_path: Path, said: str) -> None:
    before, worldbody, mass_kg = DIALECTS[said]
    path = mjcf(tmp_path, worldbody, before)
    with pytest.raises(ValueError):
        mujoco.MjModel.from_xml_path(str(path))
    asset = read_asset(path)
    assert asset.inertial.mass_kg == pytest.approx(mass_kg)
    assert any(said in sentence for sentence in asset.lenient) and set(asset.lenient) <= set(asset.remarks)
    found = [finding for finding in audit_path(path, RULES).findings if finding.code == "FIL009"]
    assert any(said in finding.message for finding in found) and all(f.severity == "warning" for f in found)


def test_global_coordinates_are_those_of_the_world(tmp_path: Path) -> None:
    compiler = '<compiler coordinate="global"/>'
    inner = '<body><joint pos="0 0 1.05" axis="0 1 0"/><geom type="capsule" fromto="0 0 1 0 0 0.6" size="0.05"/></body>'
    for place in ("", 'pos="0 0 1.25"'):
        body = f'<body {place}><freejoint/><geom type="box" pos="0.3 0 1.25" size="0.1 0.2 0.3"/>{inner}</body>'
        asset = read_asset(mjcf(tmp_path, body.replace('type="box" ', 'type="box" mass="1" '), compiler))
        stands = [0.3, 0, 1.25] if not place else [0.3, 0, 0]  # in the axes of its body
        assert np.allclose(np.mean(asset.visual[0].bounds, axis=0), stands)
        assert any("global" in sentence for sentence in asset.lenient)
    turned = '<body pos="0 0 1" euler="0 0 90"><geom size="0.1"/></body>'
    with pytest.raises(AssetError, match="global coordinates"):
        read_asset(mjcf(tmp_path, turned, compiler))


def test_a_body_at_a_place_that_mujoco_does_not_know_is_not_left_out(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="unrecognized element"):
        read_asset(mjcf(tmp_path, '<body><geom size="0.1"><body><geom size="0.2"/></body></geom></body>'))
    many = " ".join(f'a{n}="1"' for n in range(20))
    with pytest.raises(AssetError, match=r"does not know \d+ of its elements and attributes or more"):
        read_asset(mjcf(tmp_path, f'<body><geom size="0.1" {many}/></body>'))
