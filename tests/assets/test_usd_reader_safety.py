"""Stages that somebody made to do harm, or broke."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf

from manitwin.assets.readers.usd import read, read_here
from manitwin.errors import AssetError

CUBE = 'def Cube "cube" {}\n'


def write(file: Path, text: str) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"#usda 1.0\n{text}")
    return file


def shapes(file: Path) -> list[str]:
    return [part.metadata["name"] for part in read_here(file).visual]


@pytest.mark.parametrize(
    "named", ["../secret.usda", "/{outside}", "link.usda", "file:///{outside}", "http://127.0.0.1:9/a.usda",
              "sub/../../secret.usda", "`\\\"../secret.usda\\\"`", "//host/share/a.usda", "secret.usda[x]", "C:/a.usda"],
)  # fmt: skip
@pytest.mark.parametrize("arc", ["subLayers", "references", "payload", "variant"])
def test_layers_outside_the_folder_are_not_followed(tmp_path: Path, named: str, arc: str) -> None:
    outside = write(tmp_path / "secret.usda", '(defaultPrim="s")\ndef Xform "s" {\n def Cube "secret" {}\n}\n')
    folder = tmp_path / "asset"
    (folder / "sub").mkdir(parents=True)
    (folder / "link.usda").symlink_to(outside)
    asset_path = f"@{named.format(outside=outside).replace('//tmp', '/tmp')}@"
    text = {
        "subLayers": f'(defaultPrim="a"\n subLayers=[{asset_path}]\n)\ndef Xform "a" {{\n {CUBE}}}\n',
        "references": f'(defaultPrim="a")\ndef Xform "a" (references={asset_path}) {{\n {CUBE}}}\n',
        "payload": f'(defaultPrim="a")\ndef Xform "a" (payload={asset_path}) {{\n {CUBE}}}\n',
        "variant": '(defaultPrim="a")\ndef Xform "a" (\n variants = {\n string v = "x"\n }\n prepend variantSets = "v"\n) {\n'
        f' {CUBE} variantSet "v" = {{\n "x" (references={asset_path}) {{\n }}\n }}\n}}\n',
    }[arc]
    file = write(folder / "a.usda", text)
    asset = read_here(file)
    assert [part.metadata["name"] for part in asset.visual] == ["cube"]
    assert any("was not followed" in remark for remark in asset.remarks)
    assert asset.files == (file.resolve(),)


def test_loop_of_links_is_no_layer(tmp_path: Path) -> None:
    (tmp_path / "loop.usda").symlink_to("loop.usda")
    file = write(tmp_path / "a.usda", f'(defaultPrim="a"\n subLayers=[@loop.usda@]\n)\ndef Xform "a" {{\n {CUBE}}}\n')
    asset = read_here(file)
    assert len(asset.visual) == 1 and any("was not followed" in remark for remark in asset.remarks)


@pytest.mark.parametrize("arc", ["subLayers", "references", "payload", "variant"])
def test_the_same_arcs_are_followed_inside_of_it(tmp_path: Path, arc: str) -> None:
    write(tmp_path / "sub" / "b.usda", '(defaultPrim="a")\ndef Xform "a" {\n def Cube "inner" {}\n}\n')
    text = {
        "subLayers": '(defaultPrim="a"\n subLayers=[@sub/b.usda@]\n)\n',
        "references": '(defaultPrim="a")\ndef Xform "a" (references=@./sub/b.usda@) {}\n',
        "payload": '(defaultPrim="a")\ndef Xform "a" (payload=@sub/../sub/b.usda@) {}\n',
        "variant": '(defaultPrim="a")\ndef Xform "a" (\n variants = {\n string v = "x"\n }\n prepend variantSets = "v"\n) {\n'
        ' variantSet "v" = {\n "x" (references=@./sub/b.usda@) {\n }\n }\n}\n',
    }[arc]
    file = write(tmp_path / "a.usda", text)
    assert shapes(file) == ["inner"]
    assert [each.name for each in read_here(file).files] == ["a.usda", "b.usda"]


def test_textures_outside_the_folder_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "secret.png").write_bytes(b"not a picture")
    text = """(defaultPrim="a")
def Xform "a" {
 def Mesh "m" (prepend apiSchemas=["MaterialBindingAPI"]) {
  point3f[] points = [(0,0,0),(1,0,0),(0,1,0)]
  int[] faceVertexCounts = [3]
  int[] faceVertexIndices = [0,1,2]
  texCoord2f[] primvars:st = [(0,0),(1,0),(0,1)] (interpolation="vertex")
  rel material:binding = </a/k>
 }
 def Material "k" {
  token outputs:surface.connect = </a/k/s.outputs:surface>
  def Shader "s" {
   uniform token info:id = "UsdPreviewSurface"
   color3f inputs:diffuseColor.connect = </a/k/t.outputs:rgb>
   token outputs:surface
  }
  def Shader "t" {
   uniform token info:id = "UsdUVTexture"
   asset inputs:file = @../secret.png@
   float3 outputs:rgb
  }
 }
}
"""
    asset = read_here(write(tmp_path / "asset" / "a.usda", text))
    assert asset.visual[0].visual.material.baseColorTexture is None
    assert any("texture '../secret.png' lies outside" in remark for remark in asset.remarks)


def test_circles_of_layers_end(tmp_path: Path) -> None:
    write(
        tmp_path / "b.usda",
        '(defaultPrim="a"\n subLayers=[@a.usda@, @b.usda@]\n)\ndef Xform "a" (references=@a.usda@) {}\n',
    )
    file = write(tmp_path / "a.usda", f'(defaultPrim="a"\n subLayers=[@b.usda@]\n)\ndef Xform "a" {{\n {CUBE}}}\n')
    assert shapes(file) == ["cube"]


def test_value_clips_are_not_opened(tmp_path: Path) -> None:
    clips = 'clips = {\n dictionary default = {\n asset[] assetPaths = [@/etc/passwd@]\n string primPath = "/a"\n }\n }'
    file = write(tmp_path / "a.usda", f'(defaultPrim="a")\ndef Xform "a" (\n {clips}\n) {{\n {CUBE}}}\n')
    asset = read_here(file)
    assert any("value clips" in remark for remark in asset.remarks)


@pytest.mark.parametrize("levels", [16, 60, 400])
def test_references_that_multiply_are_refused_before_they_are_composed(tmp_path: Path, levels: int) -> None:
    doubling = "".join(
        f'def Xform "p{i}" {{\n def "a" (references=</p{i - 1}>) {{}}\n def "b" (references=</p{i - 1}>) {{}}\n}}\n'
        for i in range(1, levels + 1)
    )
    file = write(tmp_path / "a.usda", f'(defaultPrim="p{levels}")\n{CUBE.replace("cube", "p0")}{doubling}')
    with pytest.raises(AssetError, match="composes to more than 100000 prims"):
        read_here(file)


def test_references_into_what_is_referenced_are_counted_too(tmp_path: Path) -> None:
    """Every level refers below a prim that has no specs of its own there."""
    doubling = "".join(
        f'def Xform "p{i}" {{\n def "x" {{\n def "a" (references=</p{i - 1}/x>) {{}}\n def "b" (references=</p{i - 1}/x>) {{}}\n'
        " }\n}\n"
        for i in range(1, 41)
    )
    file = write(tmp_path / "a.usda", f'(defaultPrim="p40")\ndef Xform "p0" {{\n def Cube "x" {{}}\n}}\n{doubling}')
    with pytest.raises(AssetError, match="composes to more than"):
        read_here(file)


MESH = """(defaultPrim="a"
 metersPerUnit = {unit}
)
def Xform "a" (prepend apiSchemas=["PhysicsMassAPI"]) {{
 float physics:mass = {mass}
 float3 physics:diagonalInertia = (1, 1, {inertia})
 double3 xformOp:translate = (0, 0, {shift})
 uniform token[] xformOpOrder = ["xformOp:translate"]
 def Mesh "m" {{
  point3f[] points = [(0,0,0),(1,0,0),(0,1,{point})]
  int[] faceVertexCounts = [{count}]
  int[] faceVertexIndices = [0,1,{index}]
 }}
 def Sphere "s" {{
  double radius = {radius}
 }}
}}
"""
SOUND = {
    "unit": "1", "mass": "1", "inertia": "1", "shift": "0", "point": "0", "count": "3", "index": "2", "radius": "1",
}  # fmt: skip


@pytest.mark.parametrize(
    "changed",
    [
        {"unit": "nan"}, {"unit": "0"}, {"unit": "1e300"}, {"unit": "-1"}, {"mass": "nan"}, {"mass": "inf"},
        {"inertia": "nan"}, {"shift": "nan"}, {"shift": "1e300"}, {"point": "nan"}, {"point": "1e30"}, {"count": "4"},
        {"count": "-3"}, {"index": "7"}, {"index": "-1"}, {"radius": "nan"}, {"radius": "-1"}, {"radius": "1e300"},
    ],
    ids=str,
)  # fmt: skip
def test_hostile_numbers_are_errors_in_one_line(tmp_path: Path, changed: dict[str, str]) -> None:
    file = write(tmp_path / "a.usda", MESH.format(**SOUND))
    assert read_here(file).inertial.mass_kg == 1
    with pytest.raises(AssetError) as raised:
        read_here(write(tmp_path / "a.usda", MESH.format(**{**SOUND, **changed})))
    assert "\n" not in str(raised.value) and "a.usda" in str(raised.value)


@pytest.mark.parametrize("kept", [0, 4, 100, 0.5, 0.98])
def test_truncated_files_are_errors_and_the_next_file_is_read(tmp_path: Path, kept: float) -> None:
    sound = write(tmp_path / "sound.usda", f'(defaultPrim="a"\n metersPerUnit=1\n)\ndef Xform "a" {{\n {CUBE}}}\n')
    Sdf.Layer.FindOrOpen(str(sound)).Export(str(tmp_path / "a.usdc"))
    data = (tmp_path / "a.usdc").read_bytes()
    (tmp_path / "a.usdc").write_bytes(data[: int(kept if kept >= 4 else kept * len(data))])
    with pytest.raises(AssetError, match=r"a\.usdc") as raised:
        read(tmp_path / "a.usdc")
    assert "\n" not in str(raised.value)
    assert len(read(sound).visual) == 1


@pytest.mark.parametrize("seed", range(30))
def test_binary_files_with_a_few_bytes_turned_never_end_this_process(tmp_path: Path, seed: int) -> None:
    sound = write(tmp_path / "sound.usda", MESH.format(**SOUND))
    Sdf.Layer.FindOrOpen(str(sound)).Export(str(tmp_path / "a.usdc"))
    data = bytearray((tmp_path / "a.usdc").read_bytes())
    rng = np.random.default_rng(seed)
    for place in rng.integers(8, len(data), 6):
        data[place] = int(rng.integers(256))
    (tmp_path / "a.usdc").write_bytes(bytes(data))
    try:
        read(tmp_path / "a.usdc")
    except AssetError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("written", "instead"),
    [
        ("float physics:mass = 1", 'string physics:mass = "1"'),
        ("float3 physics:diagonalInertia = (1, 1, 1)", "float physics:diagonalInertia = 1"),
        ("point3f[] points = [(0,0,0),(1,0,0),(0,1,0)]", "float[] points = [0, 1, 2]"),
        ("double radius = 1", 'token radius = "1"'),
    ],
)
def test_values_of_another_type_than_their_schemas_are_errors(tmp_path: Path, written: str, instead: str) -> None:
    text = MESH.format(**SOUND)
    assert text.count(written) == 1
    with pytest.raises(AssetError, match=rf"{written.split()[1]} is a {instead.split()[0].partition('[')[0]}"):
        read_here(write(tmp_path / "a.usda", text.replace(written, instead)))


def test_text_that_is_no_usd_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "a.usda").write_text("hello\n")
    with pytest.raises(AssetError, match=r"a\.usda"):
        read(tmp_path / "a.usda")
