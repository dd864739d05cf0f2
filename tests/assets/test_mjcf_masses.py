"""The mass properties of MJCF files: declared, computed, or not said."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from written_mjcf import mjcf

from manitwin.assets.importers.conversion import imported_files
from manitwin.assets.importers.record import asset_to_object, import_record
from manitwin.assets.read import read_asset
from manitwin.twin.import_record import IMPORT_RECORD


def test_inertial_is_what_the_file_says(tmp_path: Path) -> None:
    inertial = '<inertial pos="0.01 0 0.02" mass="0.3" fullinertia="2e-3 3e-3 4e-3 1e-4 2e-4 3e-4"/>'
    asset = read_asset(mjcf(tmp_path, f'<body><freejoint/>{inertial}<geom size="0.05"/></body>'))
    assert asset.inertial.mass_kg == pytest.approx(0.3)
    assert np.allclose(asset.inertial.center_of_mass_m, [0.01, 0, 0.02])
    tensor = [[2e-3, 1e-4, 2e-4], [1e-4, 3e-3, 3e-4], [2e-4, 3e-4, 4e-3]]  # MJCF order: xx yy zz xy xz yz
    assert np.allclose(asset.inertial.inertia_kg_m2, tensor, rtol=1e-9)


def test_mass_of_mujocos_own_density_is_not_declared(tmp_path: Path) -> None:
    asset = read_asset(mjcf(tmp_path, '<body><freejoint/><geom size="0.05"/></body>'))
    assert asset.inertial.mass_kg is None and asset.contact.friction_static is None


def test_mass_of_a_written_density_is_declared_and_said(tmp_path: Path) -> None:
    default = '<default><geom density="100" friction="0.8 0.01 0.001"/></default>'
    asset = read_asset(mjcf(tmp_path, '<body><freejoint/><geom size="0.05"/></body>', default))
    mass_kg = 100 * 4 / 3 * np.pi * 0.05**3
    assert asset.inertial.mass_kg == pytest.approx(mass_kg)
    assert np.allclose(asset.inertial.center_of_mass_m, 0, atol=1e-12)
    assert np.allclose(asset.inertial.inertia_kg_m2, 0.4 * mass_kg * 0.05**2 * np.eye(3), rtol=1e-9)
    assert asset.contact.friction_static == asset.contact.friction_dynamic == 0.8
    assert any("density" in remark for remark in asset.remarks)


def test_of_several_frictions_that_of_the_most_area_is_the_twins_and_the_others_are_its_interval(
    tmp_path: Path,
) -> None:
    grip = '<geom type="box" size="0.01 0.01 0.01" pos="0 0 0.1" friction="1.4"/>'
    shank = '<geom name="shank" type="box" size="0.02 0.02 0.1" pos="0 0 0.3" friction="0.3"/>'
    file = mjcf(tmp_path, f'<body><freejoint/>{grip}{shank}<geom name="tip" size="0.005" friction="0.5"/></body>')
    asset = read_asset(file)
    assert asset.contact.friction_static == asset.contact.friction_dynamic == 0.3
    assert asset.contact.friction_range == (0.3, 1.4)
    assert any(
        "frictions from 0.3 to 1.4; a twin has one: 0.3, that of the most area" in line for line in asset.remarks
    )
    record = import_record(asset, asset_to_object(asset))
    assert (record.friction_static, record.friction_range) == (0.3, (0.3, 1.4))
    same = read_asset(mjcf(tmp_path, f"<body><freejoint/>{shank}</body>"))
    assert same.contact.friction_range is None
    files, _ = imported_files(same)
    assert b"friction_range" not in files[IMPORT_RECORD]  # what had one friction before keeps its identity


def test_contacts_of_pairs_are_told(tmp_path: Path) -> None:
    body = '<geom name="floor" type="plane" size="1 1 1"/><body><freejoint/><geom name="a" size="0.1" friction="0.4"/></body>'
    file = mjcf(tmp_path, body, '<contact><pair geom1="floor" geom2="a" friction="2 2 0.1 0.1 0.1"/></contact>')
    assert any("<pair> says of its contact with other geoms (1)" in line for line in read_asset(file).remarks)


def test_a_mass_of_geoms_in_several_bodies_is_combined_as_mujoco_has_it(tmp_path: Path) -> None:
    bodies = (
        '<body pos="1 0 0"><freejoint/><geom size="0.05" mass="0.2" pos="0.1 0 0"/>'
        '<body pos="0 0 0.3" euler="0 0 30"><geom type="box" size="0.1 0.05 0.02" mass="0.4"/></body></body>'
    )
    path = mjcf(tmp_path, bodies)
    inertial = read_asset(path).inertial
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert inertial.mass_kg == pytest.approx(float(model.body_subtreemass[1]))
    assert np.allclose(inertial.center_of_mass_m, data.subtree_com[1] - [1, 0, 0], atol=1e-9)
    spinning = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, spinning)
    about_origin = spinning[3:, 3:]  # of the free joint's turn, about the body's own origin
    c = inertial.center_of_mass_m
    moved = inertial.mass_kg * (c @ c * np.eye(3) - np.outer(c, c))
    assert np.allclose(inertial.inertia_kg_m2 + moved, about_origin, rtol=1e-6, atol=1e-9)


def test_a_mass_of_all_together_is_declared(tmp_path: Path) -> None:
    two = "".join(f'<body name="b{n}" pos="{n} 0 0"><joint/><geom size="0.1"/></body>' for n in range(2))
    assert read_asset(mjcf(tmp_path, two)).inertial.mass_kg is None
    whole = read_asset(mjcf(tmp_path, two, '<compiler settotalmass="14"/>'))
    assert whole.inertial.mass_kg == pytest.approx(7) and whole.inertial.computed


def test_a_mass_that_a_part_declares_is_declared(tmp_path: Path) -> None:
    pole = '<body pos="0 0 1"><geom type="box" size="0.05 0.05 0.05"/></body>'
    inertial = '<inertial pos="0 0 0" mass="10" diaginertia="1 1 1"/>'
    asset = read_asset(mjcf(tmp_path, f'<body><freejoint/>{inertial}<geom size="0.1"/>{pole}</body>'))
    assert asset.inertial.mass_kg == pytest.approx(11) and asset.inertial.computed
    assert any("a part of its mass is declared" in remark for remark in asset.remarks)


def test_a_mass_that_is_mostly_of_mujocos_own_density_is_not_declared(tmp_path: Path) -> None:
    top, legs = '<geom type="box" size="0.5 0.3 0.01" mass="4"/>', '<geom type="box" size="0.5 0.3 0.1" pos="0 0 0.3"/>'
    table = read_asset(mjcf(tmp_path, f"<body><freejoint/>{top}{legs}</body>"))  # 4 kg and 120 kg
    assert table.inertial.mass_kg is None
    assert any("of 124 kg the file declares 4" in remark for remark in table.remarks)
    dense = legs.replace("/>", ' density="1000"/>')
    said = read_asset(mjcf(tmp_path, f"<body><freejoint/>{top}{dense}</body>"))
    assert said.inertial.mass_kg == pytest.approx(124), "who writes 1000 kg/m3 means it"
    door = '<body pos="1 0 0"><joint axis="0 0 1"/><geom size="0.1" mass="2"/></body>'
    kept = read_asset(mjcf(tmp_path, f'<body><freejoint/><geom size="0.3"/>{door}</body>'), joints="keep")
    body, leaf = kept.articulation.links
    assert body.inertial.mass_kg is None and leaf.inertial.mass_kg == pytest.approx(2) and kept.inertial.mass_kg is None


@pytest.mark.parametrize("kind", ["mesh", "box"])
def test_a_place_that_is_seen_and_collides_is_weighed_once(tmp_path: Path, kind: str) -> None:
    """A density for the collision shapes alone: MuJoCo weighs what is seen too, an apple of 0.41 kg as 0.74."""
    hulls = "".join(f'<geom class="hull" type="box" size="0.02 0.03 0.04" pos="{x} 0 0"/>' for x in (-0.02, 0.02))
    if kind == "mesh":
        trimesh.creation.box((0.08, 0.06, 0.08)).export(tmp_path / "look.stl")
    look = '<geom type="mesh" mesh="look"/>' if kind == "mesh" else '<geom type="box" size="0.04 0.03 0.04"/>'
    before = '<default><default class="hull"><geom density="1250"/></default></default>'
    before += '<asset><mesh name="look" file="look.stl"/></asset>' if kind == "mesh" else ""
    volume_m3 = 0.08 * 0.06 * 0.08
    inertial = read_asset(path := mjcf(tmp_path, f"<body><freejoint/>{look}{hulls}</body>", before)).inertial
    assert float(mujoco.MjModel.from_xml_path(str(path)).body_mass[1]) == pytest.approx(2250 * volume_m3)
    assert inertial.mass_kg == pytest.approx(1250 * volume_m3) and inertial.computed
    assert inertial.engine_kg == pytest.approx(2250 * volume_m3)
    sides = np.array([0.08, 0.06, 0.08]) ** 2
    assert np.allclose(inertial.inertia_kg_m2, np.diag(inertial.mass_kg * (sides.sum() - sides) / 12), rtol=1e-6)
    assert any("MuJoCo has 0.864," in remark for remark in read_asset(path).remarks)


def test_a_part_without_a_density_elsewhere_is_weighed(tmp_path: Path) -> None:
    head, handle = '<geom size="0.03" density="7000"/>', '<geom type="box" size="0.1 0.01 0.01" pos="0.1 0 0"/>'
    asset = read_asset(mjcf(tmp_path, f"<body><freejoint/>{head}{handle}</body>"))
    assert asset.inertial.mass_kg == pytest.approx(7000 * 4 / 3 * np.pi * 0.03**3 + 1000 * 8e-5)
