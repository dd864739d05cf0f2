"""Exports loaded back by the engines they are for: all have the twin's mass, centre of mass, inertia, friction and size."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

import exported_twins as made
from export_engines import PHYSX_TOLERANCE_M, assert_same, body_of, in_mujoco, in_pybullet, in_sapien, sdf_text
from manitwin.api import build
from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.write import export_twin
from manitwin.formats.meshes.textures import make_part, material_of
from manitwin.twin.loaded_twin import Twin
from real_meshes import mesh_rows


def assert_engines_agree(twin: TwinContent, out: Path) -> None:
    truth, physical = body_of(twin), twin.physical
    contact = (physical.friction_static.value, physical.friction_dynamic.value, physical.restitution.value)
    assert_same(in_mujoco(export_twin(twin, "mjcf", out)), truth)
    urdf = export_twin(twin, "urdf", out)
    assert_same(in_sapien(urdf, contact), truth, cooked_m=PHYSX_TOLERANCE_M)
    assert_same(in_pybullet(urdf), truth)
    sdf = export_twin(twin, "sdf", out)
    assert_same(replace(sdf_text(sdf), box_m=truth.box_m), truth, share=1e-6)
    assert_same(in_pybullet(sdf), truth, inertia=False, friction=False)


@pytest.fixture
def twin(tmp_path: Path) -> TwinContent:
    return made.content(tmp_path / "twin")


def test_engines_agree_on_a_lopsided_body(twin: TwinContent, tmp_path: Path) -> None:
    assert_engines_agree(twin, tmp_path)


def test_engines_agree_on_a_thin_plate(tmp_path: Path) -> None:
    """Of a plate the largest moment is all but the sum of the others: rounding must not make engines refuse it."""
    moments = [1e-5, 3e-5, 4e-5 * (1 + 1e-12)]
    assert_engines_agree(
        made.content(tmp_path / "twin", physical={"inertia_kg_m2": np.diag(moments).tolist()}), tmp_path
    )


def test_mujoco_attaches_several_to_a_scene_and_leaves_its_options(twin: TwinContent, tmp_path: Path) -> None:
    other = made.content(tmp_path / "other", twin_id="0123456789abcdef", language={"category": "mug"})
    files = [export_twin(each, "mjcf", tmp_path / "out") for each in (twin, other)]
    scene = mujoco.MjSpec()
    scene.option.timestep, scene.option.gravity = 0.004, [0, 0, -1.62]
    for number, file in enumerate([files[0], files[1], files[0]]):
        frame = scene.worldbody.add_frame(pos=[number, 0, 0])
        scene.attach(mujoco.MjSpec.from_file(str(file)), frame=frame, prefix=f"{number}_")
    model = scene.compile()
    assert (model.opt.timestep, model.opt.gravity[2]) == (0.004, -1.62)
    np.testing.assert_allclose(model.body_mass[1:], made.MASS_KG)
    assert model.njnt == 3 and not (model.geom_bodyid == 0).any()  # three free bodies, no floor


def test_mujoco_includes_two_twins_in_one_file(twin: TwinContent, tmp_path: Path) -> None:
    other = made.content(tmp_path / "other", twin_id="0123456789abcdef", language={"category": "mug"})
    names = [export_twin(each, "mjcf", tmp_path / "out").stem for each in (twin, other)]
    for name in names:  # MuJoCo looks for meshes beside the file that includes
        for mesh in (tmp_path / "out" / name / "mjcf" / "assets").iterdir():
            (tmp_path / "out" / "assets").mkdir(exist_ok=True)
            mesh.rename(tmp_path / "out" / "assets" / mesh.name)
    both = tmp_path / "out" / "both.xml"
    both.write_text("<mujoco>" + "".join(f'<include file="{n}/mjcf/{n}.xml"/>' for n in names) + "</mujoco>")
    assert mujoco.MjModel.from_xml_path(str(both)).nbody == 3


def test_visual_geoms_of_mjcf_weigh_nothing_and_touch_nothing(twin: TwinContent, tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(export_twin(twin, "mjcf", tmp_path)))
    seen = model.geom_group == 2
    assert seen.sum() == 3 and (model.geom_group[~seen] == 3).all()
    assert not model.geom_contype[seen].any() and not model.geom_conaffinity[seen].any()
    assert (model.geom_condim[~seen] == 4).all() and (model.geom_friction[~seen] == [made.STATIC, 0.005, 1e-4]).all()


def test_mujoco_sees_the_texture_the_right_way_up(twin: TwinContent, tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(export_twin(twin, "mjcf", tmp_path)))
    [painted] = [g for g in range(model.ngeom) if model.mat_texid[model.geom_matid[g]].max() >= 0]
    mesh = model.geom_dataid[painted]
    start, count = model.mesh_texcoordadr[mesh], model.mesh_texcoordnum[mesh]
    uv = model.mesh_texcoord[start : start + count]
    picture = model.tex_data.reshape(int(model.tex_height[0]), int(model.tex_width[0]), -1)
    rows, columns = (np.clip((uv[:, i] * 16).astype(int), 0, 15) for i in (1, 0))  # row 0 of OpenGL's texture is v = 0
    colors = {tuple(int(c > 127) for c in pixel) for pixel in picture[rows, columns, :3]}
    assert colors == {(0, 0, 1), (1, 1, 0), (1, 0, 0)}  # blue, yellow, red; upside down it were red, green, blue
    plain = [
        model.mat_rgba[model.geom_matid[g]] for g in range(model.ngeom) if model.geom_group[g] == 2 and g != painted
    ]
    encoded = [
        1.055 * c ** (1 / 2.4) - 0.055 for c in np.round(np.array(made.BASE_COLOR_LINEAR) * 255) / 255
    ]  # IEC 61966-2-1
    np.testing.assert_allclose(plain, [[*encoded, 1.0]] * 2, atol=1e-5)


def test_a_part_too_small_for_mujoco_is_left_out_and_said(twin: TwinContent, tmp_path: Path) -> None:
    part = twin.visual[1]
    triangle = make_part(part.vertices[:3], np.array([[0, 1, 2]]), material=material_of(part), name="speck")
    sparse = replace(twin, visual=(*twin.visual, triangle))
    file = export_twin(sparse, "mjcf", tmp_path)
    assert (mujoco.MjModel.from_xml_path(str(file)).geom_group == 2).sum() == 3
    assert "1 visual parts of fewer than 4 vertices" in (file.parent / "README.md").read_text()


def test_what_a_format_cannot_say_is_in_physics_json(twin: TwinContent, tmp_path: Path) -> None:
    for name in ("mjcf", "urdf", "sdf"):
        folder = tmp_path / made.NAME / name
        export_twin(twin, name, tmp_path)
        physics = json.loads(next(folder.rglob("physics.json")).read_text())
        assert physics["friction_static"] == made.estimate(made.STATIC)
        assert physics["friction_dynamic"] == made.estimate(made.DYNAMIC)
        assert sorted(physics["principal_moments_kg_m2"]) == pytest.approx(made.MOMENTS_KG_M2.tolist(), rel=1e-9)


@pytest.mark.slow
@pytest.mark.shared_data
@pytest.mark.parametrize("mesh", ["mug_ycb", "bowl_evo", "frypan_8in", "salt_shaker"])
def test_engines_agree_on_built_twins(shared_data: Path, tmp_path: Path, mesh: str) -> None:
    source = shared_data / mesh_rows(shared_data)[mesh]["file"]
    [result] = build(source, tmp_path / "twins", name=mesh.split("_")[0], jobs=1, quick=True).results
    assert result.folder is not None
    assert_engines_agree(TwinContent.of(Twin(result.folder)), tmp_path / "out")
