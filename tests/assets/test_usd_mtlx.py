"""Materials of MaterialX documents beside a stage: colours and pictures that its meshes get, and documents that are not read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from pxr import Usd, UsdGeom, UsdShade

from manitwin.assets.asset import Asset
from manitwin.assets.readers.usd import read_here

GRAPH = """<nodegraph name="NG"><input name="picture" type="filename" value="tex/skin.png"/>
<image name="skin" type="color3"><input name="file" type="filename" {file}/></image>
<multiply name="tinted" type="color3"><input name="in1" type="color3" nodename="skin"/></multiply>
<output name="out" type="color3" nodename="tinted"/></nodegraph>"""
PLAIN = '<input name="base_color" type="color3" value="{}"/>'
FROM_GRAPH = '<input name="base_color" type="color3" nodegraph="NG" output="out"/>'


def document(inside: str, *, graph: str = "", surface: str = "standard_surface", head: str = "") -> str:
    return (
        f'<?xml version="1.0"?><materialx version="1.38" {head}>{graph}'
        f'<{surface} name="S" type="surfaceshader">{inside}</{surface}>'
        '<surfacematerial name="Paint" type="material"><input name="surfaceshader" type="surfaceshader" nodename="S"/>'
        "</surfacematerial></materialx>"
    )


def written(folder: Path, text: str, *, named: str = "./paint.mtlx", path: str = "/MaterialX/Materials") -> Path:
    """A triangle bound to the material ``Paint`` of a document beside its stage."""
    (folder / "tex").mkdir(parents=True, exist_ok=True)
    Image.new("RGB", (4, 4), (10, 200, 30)).save(folder / "tex" / "skin.png")
    (folder / "paint.mtlx").write_text(text)
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/thing").GetPrim())
    mesh = UsdGeom.Mesh.Define(stage, "/thing/mesh")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    binding = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim())
    below = "Materials/Paint" if path == "/MaterialX" else "Paint"
    binding.GetDirectBindingRel().SetTargets([f"/thing/look/{below}"])
    text = stage.GetRootLayer().ExportToString()
    reference = f'\n    def Scope "look" (prepend references = @{named}@<{path}>) {{}}\n}}\n'
    (folder / "thing.usda").write_text(text.rstrip()[:-1] + reference)
    return folder / "thing.usda"


def material(asset: Asset) -> Any:
    return asset.visual[0].visual.material


@pytest.mark.parametrize("surface", ["standard_surface", "open_pbr_surface", "gltf_pbr"])
@pytest.mark.parametrize("path", ["/MaterialX/Materials", "/MaterialX"])
def test_a_mesh_has_the_colour_of_the_document(tmp_path: Path, surface: str, path: str) -> None:
    inside = PLAIN.format("0.2, 0.4, 0.6") + '<input name="metalness" type="float" value="0.75"/>'
    asset = read_here(written(tmp_path, document(inside, surface=surface), path=path))
    assert list(material(asset).baseColorFactor[:3]) == [51, 102, 153] and material(asset).metallicFactor == 0.75
    assert (tmp_path / "paint.mtlx").resolve() in asset.files and not asset.missing_files


def test_a_colour_that_is_said_to_be_srgb_is_made_linear(tmp_path: Path) -> None:
    inside = PLAIN.format("0.5 0.5 0.5").replace("/>", ' colorspace="srgb_texture"/>')
    factor = material(read_here(written(tmp_path, document(inside)))).baseColorFactor
    assert list(factor[:3]) == [55, 55, 55]  # 0.2140 of 255


@pytest.mark.parametrize(
    ("file", "head"),
    [('value="tex/skin.png"', ""), ('value="skin.png"', 'fileprefix="tex/"'), ('interfacename="picture"', "")],
)
def test_a_picture_of_a_graph_is_found_beside_the_document(tmp_path: Path, file: str, head: str) -> None:
    asset = read_here(written(tmp_path, document(FROM_GRAPH, graph=GRAPH.format(file=file), head=head)))
    assert material(asset).baseColorTexture.getpixel((0, 0)) == (10, 200, 30)
    assert (tmp_path / "tex" / "skin.png").resolve() in asset.files


def test_documents_and_pictures_outside_of_the_folder_are_not_read(tmp_path: Path) -> None:
    folder = tmp_path / "asset"
    file = written(folder, document(PLAIN.format("1 0 0")), named="../paint.mtlx")
    (tmp_path / "paint.mtlx").write_text(document(PLAIN.format("1 0 0")))
    asset = read_here(file)
    assert list(material(asset).baseColorFactor[:3]) != [255, 0, 0]
    assert any("'../paint.mtlx' lies outside the asset's folder" in remark for remark in asset.remarks)
    Image.new("RGB", (4, 4), (1, 2, 3)).save(tmp_path / "secret.png")
    graph = GRAPH.format(file='value="../secret.png"')
    asset = read_here(written(folder, document(FROM_GRAPH, graph=graph)))
    assert material(asset).baseColorTexture is None
    assert any("'../secret.png' lies outside" in remark for remark in asset.remarks)


def test_a_document_that_is_not_there_is_missing(tmp_path: Path) -> None:
    file = written(tmp_path, document(PLAIN.format("1 0 0")), named="./other.mtlx")
    assert read_here(file).missing_files == ("./other.mtlx",)


ENTITY = '<?xml version="1.0"?><!DOCTYPE m [<!ENTITY a SYSTEM "file:///etc/passwd">]><materialx>&a;</materialx>'


@pytest.mark.parametrize("text", ["no xml", "<robot/>", ENTITY, "", "<materialx"])
def test_what_is_no_document_leaves_the_shape_and_is_said(tmp_path: Path, text: str) -> None:
    asset = read_here(written(tmp_path, text))
    assert len(asset.visual) == 1
    assert any("paint.mtlx" in remark and "its materials were not read" in remark for remark in asset.remarks)


@pytest.mark.parametrize(
    "inside",
    [
        PLAIN.format("red"), PLAIN.format("1 2"), PLAIN.format("nan 0 0"), '<input type="color3" value="1 1 1"/>',
        '<input name="base color" type="color3" value="1 1 1"/>', '<input name="base_color" type="color3" nodename="S"/>',
        '<input name="base_color" type="filename" value="@a@"/>', FROM_GRAPH, "<!-- nothing -->",
    ],
)  # fmt: skip
def test_inputs_that_say_nothing_leave_it_grey(tmp_path: Path, inside: str) -> None:
    asset = read_here(written(tmp_path, document(inside)))
    assert len(asset.visual) == 1 and material(asset).baseColorTexture is None


def test_nodes_in_a_circle_end(tmp_path: Path) -> None:
    nodes = "".join(
        f'<add name="n{i}" type="color3"><input name="in1" type="color3" nodename="n{(i + 1) % 200}"/></add>'
        for i in range(200)
    )
    inside = '<input name="base_color" type="color3" nodename="n0"/>'
    assert len(read_here(written(tmp_path, document(inside, graph=nodes))).visual) == 1


def test_what_a_document_includes_is_not_read_and_said(tmp_path: Path) -> None:
    graph = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="../other.mtlx"/>'
    asset = read_here(written(tmp_path, document(PLAIN.format("1 0 0"), graph=graph)))
    assert list(material(asset).baseColorFactor[:3]) == [255, 0, 0]
    assert "documents that paint.mtlx includes were not read" in asset.remarks
