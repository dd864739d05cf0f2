"""Material scripts of Gazebo: their colours and textures on what an SDF shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.assets.asset import Asset
from manitwin.assets.primitives import cylinder, sphere, unwrap_primitive
from manitwin.assets.read import read_asset
from manitwin.assets.readers.ogre_script import OgreMaterial, ogre_materials
from manitwin.formats.meshes.textures import material_of, srgb_to_linear, uv_of

SCRIPT = """
// colours of a cup
material Cup/Plain
{
  technique
  {
    pass main { }
    pass { diffuse 1 0 0 1 }
  }
}
material "Cup/Base" {
  technique {
    pass {
      ambient 0.1 0.1 0.1
      diffuse 0.5 0.25 0
      specular 1 1 1 1 12.5
      texture_unit { scale 0.5 0.25
        texture label.png
      }
      texture_unit
      {
        texture light.png
      }
    }
  }
  technique { pass { diffuse 0 1 0 } }
}
/* a child
of it */
material Cup/Child : Cup/Base
{
  technique
  {
    pass
    {
      diffuse vertexcolour
      scene_blend alpha_blend
      fragment_program_ref shade
      {
        texture no.png
      }
    }
  }
}
vertex_program shade glsl
{
  source shade.glsl
}
"""


def model(folder: Path, visuals: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    text = f'<sdf version="1.6"><model name="cup"><link name="l">{visuals}</link></model></sdf>'
    (folder / "model.sdf").write_text(text)
    return folder / "model.sdf"


def visual(geometry: str, name: str, uri: str = "model://cup/materials/scripts", number: int = 0) -> str:
    script = f"<material><script><uri>{uri}</uri><name>{name}</name></script></material>"
    return f'<visual name="v{number}"><geometry>{geometry}</geometry>{script}</visual>'


def with_script(folder: Path, visuals: str) -> Asset:
    for place in ("materials/scripts", "materials/textures"):
        (folder / place).mkdir(parents=True, exist_ok=True)
    (folder / "materials/scripts/cup.material").write_text(SCRIPT)
    Image.new("RGB", (4, 4), (0, 0, 255)).save(folder / "materials/textures/label.png")
    return read_asset(model(folder, visuals))


def test_script_says_the_first_technique_pass_and_texture_with_what_is_inherited() -> None:
    found = ogre_materials(SCRIPT)
    base = OgreMaterial((0.5, 0.25, 0.0, 1.0), "label.png", (0.5, 0.25))
    assert found["Cup/Base"] == base
    assert found["Cup/Child"] == OgreMaterial(base.diffuse, base.texture, base.scale, blended=True)
    assert found["Cup/Plain"] == OgreMaterial() and len(found) == 3


@pytest.mark.parametrize("text", ["material", "material A\n{", "material A\n{\ntechnique\n{\n}\n}\n}\n}", "{ { {", ""])
def test_broken_scripts_say_what_can_be_read(text: str) -> None:
    assert set(ogre_materials(text)) <= {"A"}


def test_comments_are_passed_over_wherever_they_are() -> None:
    text = "material A // {\n{ /* // */ technique { pass { diffuse 1 0 /* 1 */ 0\n} } }\n"
    text += "// /* not open\nmaterial B {\n}\n/* material C {}"
    found = ogre_materials(text)
    assert list(found) == ["A", "B"] and found["A"].diffuse == (1.0, 0.0, 0.0, 1.0)
    assert ogre_materials("/*" * 400_000) == {}, "in the time of one pass"


def test_texture_and_colour_of_a_script_are_on_plain_shapes_and_meshes(tmp_path: Path) -> None:
    folder = tmp_path / "cup"
    (folder / "meshes").mkdir(parents=True)
    trimesh.creation.box([0.1, 0.1, 0.1]).export(folder / "meshes/bare.stl")
    asset = with_script(
        folder,
        visual("<box><size>1 2 3</size></box>", "Cup/Base")
        + visual("<mesh><uri>model://cup/meshes/bare.stl</uri></mesh>", "Cup/Base", number=1)
        + visual("<sphere><radius>0.1</radius></sphere>", "Gazebo/Red", "file://media/materials/scripts/x.material", 2),
    )
    shown, bare, red = asset.visual
    assert np.asarray(material_of(shown).baseColorTexture)[0, 0].tolist() == [0, 0, 255]
    factor = [*np.round(255 * srgb_to_linear(np.array([0.5, 0.25, 0]))), 255]
    assert np.asarray(material_of(shown).baseColorFactor).tolist() == factor
    uv = uv_of(shown)
    assert uv is not None and np.allclose(uv.min(0), [-0.5, -1.5]) and np.allclose(uv.max(0), [1.5, 2.5]), "as scaled"
    assert np.allclose(shown.extents, [1, 2, 3]) and shown.volume == pytest.approx(6)
    assert material_of(bare).baseColorTexture is None and asset.remarks == (
        "bare.stl has no texture coordinates: the texture of 'Cup/Base' is not shown",
    )
    assert np.asarray(material_of(red).baseColorFactor).tolist() == [255, 0, 0, 255] and uv_of(red) is None
    assert {"cup.material", "label.png"} <= {file.name for file in asset.files}


def test_what_a_script_names_and_is_not_there_is_said(tmp_path: Path) -> None:
    lost = with_script(tmp_path / "cup", visual("<box><size>1 1 1</size></box>", "Cup/Base"))
    assert not lost.missing_files
    (tmp_path / "cup/materials/textures/label.png").unlink()
    assert read_asset(tmp_path / "cup/model.sdf").missing_files == ("label.png",)
    outside = visual("<box><size>1 1 1</size></box>", "Cup/Base", "../materials/scripts")
    assert "'Cup/Base'" in read_asset(model(tmp_path / "other", outside)).remarks[0]


def test_a_label_goes_around_a_cylinder_as_gazebo_lays_it() -> None:
    vertices, faces, uv = unwrap_primitive(cylinder(0.5, 2.0), "cylinder")
    solid = trimesh.Trimesh(vertices, faces, process=False)
    side = np.abs(solid.face_normals[:, 2]) < 0.5
    assert solid.volume == pytest.approx(cylinder(0.5, 2.0).volume)
    middle, where = vertices[faces[side]].mean(1), uv[faces[side]].mean(1)
    assert np.allclose(where[:, 1], 0.5 - middle[:, 2] / 2), "the picture's upper edge is below"
    turned = (np.arctan2(middle[:, 0], middle[:, 1]) / (2 * np.pi) - where[:, 0] + 0.5) % 1 - 0.5
    assert np.abs(turned).max() < 1e-2, "clockwise from +Y"
    assert np.ptp(uv[faces[side]][..., 0], axis=1).max() < 0.1, "no triangle goes back around over the whole picture"


def test_a_ball_has_a_map_without_a_seam_that_shows() -> None:
    vertices, faces, uv = unwrap_primitive(sphere(1.0), "sphere")
    assert np.ptp(uv[faces][..., 0], axis=1).max() < 0.26 and 0 <= uv[:, 1].min() < 1e-9 and uv[:, 1].max() <= 1
    assert np.allclose(uv[np.argmax(vertices[:, 2]), 1], 1)


def test_a_meshs_texture_may_lie_in_another_model(tmp_path: Path) -> None:
    (tmp_path / "wheel/materials/textures").mkdir(parents=True)
    Image.new("RGB", (4, 4), (0, 0, 255)).save(tmp_path / "wheel/materials/textures/tyre.png")
    (tmp_path / "cart/meshes").mkdir(parents=True)
    (tmp_path / "cart/meshes/cart.obj").write_text(
        "mtllib cart.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
    )
    seen = '<visual name="v"><geometry><mesh><uri>model://cart/meshes/cart.obj</uri></mesh></geometry></visual>'
    for where in ("model://wheel/materials/textures/tyre.png", "model://cart/../wheel/materials/textures/tyre.png"):
        (tmp_path / "cart/meshes/cart.mtl").write_text(f"newmtl m\nmap_Kd {where}\n")
        file = model(tmp_path / "cart", seen)
        asset = read_asset(file, root=tmp_path)
        assert material_of(asset.visual[0]).baseColorTexture is not None and asset.missing_files == ()
        alone = read_asset(file, root=tmp_path / "cart")
        assert material_of(alone.visual[0]).baseColorTexture is None and alone.missing_files == (where,)
    (tmp_path / "cart/meshes/cart.mtl").write_text("newmtl m\nmap_Kd model://../../../../wheel/tyre.png\n")
    assert any("lies outside the folder" in each for each in read_asset(file, root=tmp_path).remarks)
