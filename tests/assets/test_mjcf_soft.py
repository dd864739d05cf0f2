"""Height fields, soft bodies and shapes of plug-ins in MJCF files."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from written_mjcf import mjcf, wedge

from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.rules import RULES
from manitwin.assets.read import read_asset
from manitwin.errors import AssetError


def test_height_fields_soft_bodies_and_plugins_are_left_out_and_said(tmp_path: Path) -> None:
    before = (
        '<extension><plugin plugin="mujoco.sdf.torus"><instance name="t"/></plugin></extension>'
        '<default><default class="ground"><geom type="hfield" hfield="hill"/></default></default>'
        '<asset><hfield name="hill" file="hill.png" size="1 1 1 1"/>'
        '<mesh name="torus"><plugin instance="t"/></mesh></asset>'
    )
    body = (
        '<geom class="ground"/><flexcomp name="cloth" type="grid" count="3 3 1" dim="2"/>'
        '<body name="thing"><freejoint/><geom size="0.02"/><geom type="sdf" mesh="torus"><plugin instance="t"/></geom></body>'
    )
    asset = read_asset(mjcf(tmp_path, body, before))
    assert asset.name == "thing" and len(asset.collision) == 1
    said = " ".join(asset.remarks)
    for words in ("height fields were left out", "<flexcomp> is no rigid body", "a plug-in computes"):
        assert words in said


def test_soft_bodies_alone_are_their_shape_at_rest_and_not_judged_as_rigid(tmp_path: Path) -> None:
    flex = (
        '<flexcomp name="sponge" type="grid" count="4 4 4" spacing=".02 .02 .02" dim="3" dof="radial" radius=".001" mass="1">'
        '<edge equality="true"/></flexcomp>'
    )
    path = mjcf(tmp_path, f'<body name="held" pos="0 0 1"><freejoint/>{flex}</body>')
    asset = read_asset(path)
    assert asset.soft and asset.name == "sponge" and not asset.collision
    assert np.allclose(np.ptp(asset.visual[0].vertices, axis=0), 0.06, atol=1e-6)
    found = {finding.code for finding in audit_path(path, RULES).findings}
    assert not found & {"COL001", "MAS001", "INE001", "FRI001"}
    wedge().export(tmp_path / "cloth.obj")
    cloth = '<flexcomp name="cloth" type="mesh" file="cloth.obj" dim="2" scale=".01 .01 .01" radius=".001"/>'
    seen = read_asset(mjcf(tmp_path, cloth)).visual[0].vertices
    assert np.allclose(seen.min(0), wedge().vertices.min(0) / 100, atol=1e-6)


def test_a_height_field_alone_is_its_surface(tmp_path: Path) -> None:
    heights = np.zeros((3, 4), np.uint8)
    heights[0, 3] = 255  # the upper right corner of the picture: +x, +y
    Image.fromarray(heights).save(tmp_path / "hill.png")
    before = '<asset><hfield name="hill" file="hill.png" size="2 1 .5 .1"/></asset>'
    asset = read_asset(mjcf(tmp_path, '<geom type="hfield" hfield="hill"/>', before))
    assert asset.static
    top = asset.visual[0].vertices[asset.visual[0].vertices[:, 2].argmax()]
    assert np.allclose(top, [2, 1, 0.5])


@pytest.mark.parametrize(
    ("made", "geom", "what"),
    [
        (
            'hfield name="a" nrow="100000" ncol="100000" size="1 1 1 1"',
            'type="hfield" hfield="a"',
            "height field of 1e+10",
        ),
        ('mesh name="a" builtin="cone" params="100000000 1"', 'type="mesh" mesh="a"', "built-in mesh of 1e+08"),
        ('mesh name="a" builtin="plate" params="50000 50000"', 'type="mesh" mesh="a"', "built-in mesh of 2.5e+09"),
        ('mesh name="a" builtin="supersphere" params="60000 1 1"', 'type="mesh" mesh="a"', "built-in mesh of 3.6e+09"),
    ],
)
def test_surfaces_of_too_many_points_are_refused_before_any_is_made(
    tmp_path: Path, made: str, geom: str, what: str
) -> None:
    with pytest.raises(AssetError, match=re.escape(f"a {what} points, more than 1000000")):
        read_asset(mjcf(tmp_path, f"<geom {geom}/>", f"<asset><{made}/></asset>"))


def test_soft_strings_are_rods_and_files_of_gmsh_are_read(tmp_path: Path) -> None:
    string = (
        '<flexcomp name="rope" type="grid" count="5 1 1" spacing=".1 1 1" dim="1" radius=".004" mass="1">'
        '<edge equality="true"/></flexcomp>'
    )
    rope = read_asset(mjcf(tmp_path, f'<body name="b">{string}</body>')).visual[0]
    assert np.allclose(np.ptp(rope.vertices, axis=0), [0.4, 0.008, 0.008], atol=1.5e-3)
    nodes = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1"
    (tmp_path / "tetra.msh").write_text(
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n{nodes}\n$EndNodes\n"
        "$Elements\n1\n1 4 2 0 1 1 2 3 4\n$EndElements\n"
    )
    tetra = '<flexcomp name="t" type="gmsh" file="tetra.msh" dim="3" scale=".1 .1 .1" radius=".001"/>'
    asset = read_asset(mjcf(tmp_path, f'<body name="b">{tetra}</body>'))
    assert asset.soft and len(asset.visual[0].faces) == 4
    assert np.allclose(np.ptp(asset.visual[0].vertices, axis=0), 0.1)
    (tmp_path / "tetra.msh").write_text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n")
    with pytest.raises(AssetError, match="MuJoCo cannot read"):
        read_asset(mjcf(tmp_path, f'<body name="b">{tetra}</body>'))


def test_shapes_of_plugins_alone_are_said_to_be_code(tmp_path: Path) -> None:
    before = '<extension><plugin plugin="mujoco.sdf.torus"><instance name="t"/></plugin></extension>'
    body = '<body><geom type="sdf"><plugin instance="t"/></geom></body>'
    with pytest.raises(AssetError, match="a plug-in computes: it is code"):
        read_asset(mjcf(tmp_path, body, before))
