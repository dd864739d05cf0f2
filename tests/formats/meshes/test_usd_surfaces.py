"""Materials of stages as tools write them: plain shapes, Omniverse's, MaterialX's, and textures that are moved or cut out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from manitwin.assets.asset import Asset
from manitwin.assets.readers.usd import read_here
from manitwin.formats.meshes.textures import linear_to_srgb, material_of, uv_of

HEAD = '#usda 1.0\n(\n defaultPrim = "thing"\n metersPerUnit = 1\n upAxis = "Z"\n)\n'
CUBE = (
    'def Cube "shape" (\n prepend apiSchemas = ["MaterialBindingAPI"]\n)\n{\n rel material:binding = </thing/skin>\n}\n'
)
SQUARE = """def Mesh "shape" (
 prepend apiSchemas = ["MaterialBindingAPI"]
)
{
 point3f[] points = [(0,0,0),(1,0,0),(1,1,0),(0,1,0)]
 int[] faceVertexCounts = [4]
 int[] faceVertexIndices = [0,1,2,3]
 texCoord2f[] primvars:st = [(9,9),(9,9),(9,9),(9,9)] (
  interpolation = "vertex"
 )
 texCoord2f[] primvars:second = [(0,0),(1,0),(1,1),(0,1)] (
  interpolation = "vertex"
 )
 rel material:binding = </thing/skin>
}
"""
OMNI = """def Material "skin"
{
 token outputs:mdl:surface.connect = </thing/skin/shader.outputs:out>
 def Shader "shader"
 {
  uniform token info:implementationSource = "sourceAsset"
  uniform asset info:mdl:sourceAsset = @OmniPBR.mdl@
  uniform token info:mdl:sourceAsset:subIdentifier = "OmniPBR"
  token outputs:out
  INPUTS
 }
}
"""
PREVIEW = """def Material "skin"
{
 token outputs:surface.connect = </thing/skin/shader.outputs:surface>
 def Shader "shader"
 {
  uniform token info:id = "UsdPreviewSurface"
  color3f inputs:diffuseColor.connect = </thing/skin/picture.outputs:rgb>
  INPUTS
  token outputs:surface
 }
 def Shader "picture"
 {
  uniform token info:id = "UsdUVTexture"
  asset inputs:file = @skin.png@
  float4 inputs:scale = (0.5, 1, 1, 1)
  float2 inputs:st.connect = </thing/skin/moved.outputs:result>
  float3 outputs:rgb
  float outputs:a
 }
 def Shader "moved"
 {
  uniform token info:id = "UsdTransform2d"
  float2 inputs:in.connect = </thing/skin/where.outputs:result>
  float inputs:rotation = 90
  float2 inputs:scale = (2, 3)
  float2 inputs:translation = (0.25, 0.5)
  float2 outputs:result
 }
 def Shader "where"
 {
  uniform token info:id = "UsdPrimvarReader_float2"
  string inputs:varname = "second"
  float2 outputs:result
 }
}
"""


def stage(folder: Path, *prims: str, inputs: str = "") -> Asset:
    """Read a stage of a root prim with prims below it, written as text."""
    body = "\n".join(prims).replace("INPUTS", inputs.replace("; ", "\n  "))
    (folder / "thing.usda").write_text(f'{HEAD}def Xform "thing"\n{{\n{body}\n}}\n')
    return read_here(folder / "thing.usda")


def factor(asset: Asset) -> list[int]:
    """Return the base colour factor of the only part, linear in 255ths."""
    (part,) = asset.visual
    return [int(each) for each in material_of(part).baseColorFactor]


def test_a_shape_without_a_mesh_has_its_display_colour(tmp_path: Path) -> None:
    shape = 'def Sphere "shape"\n{\n color3f[] primvars:displayColor = [(1, 0.5, 0)]\n}\n'
    assert factor(stage(tmp_path, shape)) == pytest.approx([255, 128, 0, 255], abs=2)


def test_a_shape_without_a_mesh_has_the_colour_of_its_material(tmp_path: Path) -> None:
    plain = PREVIEW.replace(
        "diffuseColor.connect = </thing/skin/picture.outputs:rgb>", "diffuseColor = (0.2, 0.4, 0.8)"
    )
    asset = stage(tmp_path, CUBE, plain, inputs="float inputs:metallic = 1")
    assert factor(asset) == [51, 102, 204, 255]
    assert material_of(asset.visual[0]).metallicFactor == 1


def test_a_shape_without_coordinates_has_the_mean_of_its_texture(tmp_path: Path) -> None:
    Image.new("RGB", (4, 4), (0, 255, 0)).save(tmp_path / "skin.png")
    asset = stage(tmp_path, CUBE, PREVIEW)
    assert factor(asset)[:3] == [0, 255, 0]
    assert material_of(asset.visual[0]).baseColorTexture is None


@pytest.mark.parametrize(
    ("inputs", "expected"),
    [
        ("color3f inputs:diffuse_color_constant = (1, 0.2, 0)", [255, 51, 0, 255]),
        ("color3f inputs:diffuse_tint = (1, 0, 0.5)", [51, 0, 26, 255]),  # over the 0.2 that OmniPBR.mdl begins with
        ("bool inputs:enable_opacity = 1; float inputs:opacity_constant = 0.4", [51, 51, 51, 102]),
        ("float inputs:opacity_constant = 0.4", [51, 51, 51, 255]),
    ],
)
def test_omniverses_material_has_its_colour(tmp_path: Path, inputs: str, expected: list[int]) -> None:
    asset = stage(tmp_path, CUBE, OMNI, inputs=inputs)
    assert factor(asset) == pytest.approx(expected, abs=1)
    assert not any("shown grey" in each for each in asset.remarks)


def test_omniverses_material_has_its_texture_and_gloss(tmp_path: Path) -> None:
    Image.new("RGB", (2, 2), (9, 8, 7)).save(tmp_path / "skin.png")
    inputs = (
        "asset inputs:diffuse_texture = @./skin.png@; float inputs:metallic_constant = 0.75"
        "; float inputs:reflection_roughness_constant = 0.125; float2 inputs:texture_scale = (2, 4)"
    )
    asset = stage(tmp_path, SQUARE.replace("primvars:second", "primvars:st0"), OMNI, inputs=inputs)
    material = material_of(asset.visual[0])
    assert material.baseColorTexture.getpixel((0, 0)) == (9, 8, 7)
    assert (material.metallicFactor, material.roughnessFactor) == (0.75, 0.125)
    np.testing.assert_allclose(uv_of(asset.visual[0]), [[18, 36]] * 4)
    assert "skin.png" in {file.name for file in asset.files}


def test_a_materialx_surface_has_its_base_colour(tmp_path: Path) -> None:
    skin = OMNI.replace("mdl:surface", "mtlx:surface").replace(
        'uniform token info:implementationSource = "sourceAsset"',
        'uniform token info:id = "ND_standard_surface_surfaceshader"',
    )
    skin = "\n".join(line for line in skin.splitlines() if "info:mdl" not in line)
    asset = stage(tmp_path, CUBE, skin, inputs="color3f inputs:base_color = (0.8, 0.4, 0); float inputs:base = 0.5")
    assert factor(asset) == [102, 51, 0, 255]


def test_a_surface_that_is_not_known_is_grey_and_named(tmp_path: Path) -> None:
    asset = stage(tmp_path, CUBE, OMNI.replace('"OmniPBR"', '"Steel"'))
    assert "material 'skin' is no UsdPreviewSurface (Steel); shown grey" in asset.remarks


def test_a_texture_lies_by_the_primvar_and_the_transform_that_its_reader_says(tmp_path: Path) -> None:
    """Scaled by (2, 3), turned counter-clockwise by a right angle, then moved by (0.25, 0.5)."""
    Image.new("RGB", (2, 2), (10, 20, 30)).save(tmp_path / "skin.png")
    (part,) = stage(tmp_path, SQUARE, PREVIEW).visual
    corners, uv = part.vertices[:, :2], uv_of(part)
    assert uv is not None
    np.testing.assert_allclose(uv, np.stack([0.25 - 3 * corners[:, 1], 0.5 + 2 * corners[:, 0]], axis=1), atol=1e-6)
    assert [int(each) for each in material_of(part).baseColorFactor] == [128, 255, 255, 255]  # the reader's scale


def test_a_texture_whose_alpha_is_the_opacity_is_cut_out(tmp_path: Path) -> None:
    Image.new("RGBA", (2, 2), (10, 20, 30, 0)).save(tmp_path / "skin.png")
    through = "float inputs:opacity.connect = </thing/skin/picture.outputs:a>"
    material = material_of(stage(tmp_path, SQUARE, PREVIEW, inputs=through).visual[0])
    assert material.alphaMode == "BLEND"
    material = material_of(
        stage(tmp_path, SQUARE, PREVIEW, inputs=f"{through}; float inputs:opacityThreshold = 0.25").visual[0]
    )
    assert (material.alphaMode, material.alphaCutoff) == ("MASK", 0.25)
    assert material_of(stage(tmp_path, SQUARE, PREVIEW).visual[0]).alphaMode is None


def test_display_colours_are_linear(tmp_path: Path) -> None:
    shape = 'def Cone "shape"\n{\n color3f[] primvars:displayColor = [(0.25, 0.25, 0.25)]\n}\n'
    shown = 255 * linear_to_srgb(np.array(factor(stage(tmp_path, shape))[:3]) / 255)
    np.testing.assert_allclose(shown, 255 * linear_to_srgb(np.full(3, 0.25)), atol=1.5)


@pytest.mark.parametrize("start", ["/home/ada/shop/", "C:\\shop\\", "omniverse://server/shop/"])
def test_a_texture_of_another_machine_is_read_from_beside_the_layer(tmp_path: Path, start: str) -> None:
    (tmp_path / "Materials").mkdir()
    Image.new("RGB", (2, 2), (9, 8, 7)).save(tmp_path / "Materials" / "skin.png")
    written = f"asset inputs:diffuse_texture = @{start}Materials/skin.png@"
    asset = stage(tmp_path, SQUARE, OMNI, inputs=written)
    assert material_of(asset.visual[0]).baseColorTexture.getpixel((0, 0)) == (9, 8, 7)
    assert "textures are not where it says, and were read from beside it, such as skin.png" in asset.remarks
    (tmp_path / "Materials" / "skin.png").unlink()
    asset = stage(tmp_path, SQUARE, OMNI, inputs=written)
    assert material_of(asset.visual[0]).baseColorTexture is None
    assert any(each.endswith("lies outside the asset's folder; it was not followed") for each in asset.remarks)


def test_a_reference_within_a_layer_is_nothing_to_remark(tmp_path: Path) -> None:
    asset = stage(tmp_path, 'def Cube "shape"\n{\n}', 'def "other" (\n references = </thing/shape>\n)\n{\n}')
    assert len(asset.visual) == 2 and not any("not followed" in each for each in asset.remarks)


@pytest.mark.parametrize(
    "inputs",
    [
        'string inputs:diffuse_tint = "red"; string inputs:metallic_constant = "much"; token inputs:texture_scale = "x"',
        "float inputs:diffuse_color_constant = 1; color3f inputs:opacity_constant = (1, 1, 1); bool inputs:enable_opacity = 1",
        "color3f inputs:diffuse_color_constant = (nan, inf, 0); float[] inputs:reflection_roughness_constant = []",
        'string inputs:diffuse_texture = "skin.png"; asset inputs:base_color = @@; matrix4d inputs:diffuse_tint',
    ],
)
def test_inputs_of_a_wrong_type_say_nothing(tmp_path: Path, inputs: str) -> None:
    (part,) = stage(tmp_path, CUBE, OMNI, inputs=inputs).visual
    assert np.isfinite(material_of(part).baseColorFactor).all()
    wrong = 'string inputs:metallic = "x"; float inputs:roughness = nan; token inputs:opacityThreshold = "y"'
    plain = PREVIEW.replace(
        "color3f inputs:diffuseColor.connect = </thing/skin/picture.outputs:rgb>", "int inputs:diffuseColor = 1"
    )
    material = material_of(stage(tmp_path, CUBE, plain, inputs=wrong).visual[0])
    assert (material.metallicFactor, material.roughnessFactor) == (0, 0.5)
    turned = PREVIEW.replace("float2 inputs:scale = (2, 3)", 'string inputs:scale = "2"')
    assert stage(tmp_path, SQUARE, turned).visual[0].faces.shape == (2, 3)
