"""Mesh files of every format: the reader of meshes, and what a build does with a file before it."""

from __future__ import annotations

import io
import json
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import trimesh
from fuzz_target import Case, target
from PIL import Image
from trimesh.visual import TextureVisuals

from collada_document import DOCUMENT
from draco_document import compressed_ball, document_of_ball, write_glb_of
from fbx_document import fbx_box
from handmade import visual
from manitwin.errors import InputError
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.packed_source import pack_source
from manitwin.pipeline.folder_listing import list_folder
from manitwin.pipeline.item import Item, twin_id
from meshopt_document import compressed_document
from skinned_document import bound_bar
from step_document import step_box
from three_mf_archive import archive, mesh_object, model

USDA = """#usda 1.0
(
    defaultPrim = "root"
    metersPerUnit = 0.01
    upAxis = "Z"
)
def Xform "root"
{
    def Mesh "square" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "faceVarying")
        double3 xformOp:translate = (5, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        rel material:binding = </root/skin>
    }
    def Material "skin"
    {
        token outputs:surface.connect = </root/skin/surface.outputs:surface>
        def Shader "surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </root/skin/texture.outputs:rgb>
            float inputs:roughness = 0.25
            token outputs:surface
        }
        def Shader "texture"
        {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @skin.png@
            float3 outputs:rgb
        }
    }
}
"""


def read(case: Case) -> None:
    """Read a mesh as a build does, and look whether what was read can be worked with."""
    for part in read_mesh(case.file).parts:
        assert np.isfinite(part.vertices).all()
        assert len(part.faces) == 0 or 0 <= part.faces.min() <= part.faces.max() < len(part.vertices)


def survey(case: Case) -> None:
    """Find the files that a mesh names, make its id, and pack it with them, as the survey of a build does."""
    list_folder(case.folder)
    try:
        item = Item(str(case.file))
        twin_id(item)
        with tempfile.TemporaryDirectory() as folder:
            pack_source(case.file, Path(folder))
    except InputError:
        pass  # a file that cannot be opened ends as a rejection


def picture(format: str = "PNG") -> bytes:
    stream = io.BytesIO()
    pixels = np.kron(
        np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]]], np.uint8), np.ones((8, 8, 1), np.uint8)
    )
    Image.fromarray(pixels).save(stream, format)
    return stream.getvalue()


def textured() -> trimesh.Trimesh:
    box = visual(
        trimesh.creation.box([0.04, 0.06, 0.1]),
        baseColorFactor=[255, 255, 255, 255],
        baseColorTexture=Image.open(io.BytesIO(picture())),
    )
    uv = np.random.default_rng(0).random((len(box.vertices), 2))
    box.visual = TextureVisuals(uv=uv, material=box.visual.material)
    box.metadata["name"] = "box"
    return box


def glb(folder: Path) -> None:
    (folder / "plain.glb").write_bytes(
        write_glb([visual(trimesh.creation.icosphere(1), baseColorFactor=[1, 2, 3, 255])])
    )
    (folder / "textured.glb").write_bytes(write_glb([textured()]))
    scene = trimesh.Scene([trimesh.creation.box(), trimesh.creation.cylinder(0.1, 1, sections=8)])
    (folder / "scene.glb").write_bytes(scene.export(file_type="glb"))


def gltf(folder: Path) -> None:
    for name, content in trimesh.Scene([textured(), trimesh.creation.box()]).export(file_type="gltf").items():
        (folder / name).write_bytes(content)
    document = json.loads((folder / "model.gltf").read_bytes())
    document["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": 0, "componentType": 5125},
        "values": {"bufferView": 1},
    }
    document["nodes"][-1] |= {"rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 2.0, 1.0], "children": []}
    (folder / "more.gltf").write_text(json.dumps(document))
    (folder / "bound.gltf").write_text(json.dumps(bound_bar()[0]))
    (folder / "compressed.gltf").write_text(json.dumps(compressed_document("exponential")))


def obj(folder: Path) -> None:
    (folder / "skin.png").write_bytes(picture())
    (folder / "box.mtl").write_text(
        "newmtl skin\nKd 0.8 0.1 0.1\nd 1.0\nNs 20\nmap_Kd -s 1 1 1 skin.png\nnewmtl b\nTr 0\n"
    )
    box = trimesh.creation.box()
    lines = [
        "mtllib box.mtl",
        "o box",
        "usemtl skin",
        *(f"v {x} {y} {z}" for x, y, z in box.vertices),
        "vt 0 0",
        "vt 1 0",
        "vn 0 0 1",
    ]
    lines += [f"f {a + 1}/1/1 {b + 1}/2/1 {c + 1}/1/1" for a, b, c in box.faces[:6]]
    lines += ["usemtl b", *(f"f {a - 8} {b - 8} {c - 8}" for a, b, c in box.faces[6:]), "f 1 2 3 4", "s off", "l 1 2"]
    (folder / "box.obj").write_text("\n".join(lines) + "\n")
    (folder / "hull.obj").write_text(box.export(file_type="obj"))


def ply(folder: Path) -> None:
    ball = trimesh.creation.icosphere(1)
    ball.visual.vertex_colors = np.random.default_rng(0).integers(0, 255, (len(ball.vertices), 4))
    (folder / "ascii.ply").write_bytes(ball.export(file_type="ply", encoding="ascii"))
    (folder / "binary.ply").write_bytes(ball.export(file_type="ply", encoding="binary"))
    (folder / "skin.png").write_bytes(picture())
    head = "ply\nformat ascii 1.0\ncomment TextureFile skin.png\nelement vertex 4\n" + "".join(
        f"property float {c}\n" for c in "xyzst"
    )
    head += "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
    rows = "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3 8 0 0 1 0 1 1 0 1\n3 0 1 2 6 0 0 1 0 1 1\n"
    (folder / "texture.ply").write_text(head + rows)
    big = head.replace("ascii", "binary_big_endian").encode() + np.arange(20, dtype=">f4").tobytes()
    faces = b"\x03" + np.array([0, 1, 2], ">i4").tobytes() + b"\x06" + np.zeros(6, ">f4").tobytes()
    (folder / "big.ply").write_bytes(big + faces + faces)


def stl(folder: Path) -> None:
    ball = trimesh.creation.icosphere(1)
    (folder / "binary.stl").write_bytes(ball.export(file_type="stl"))
    (folder / "ascii.stl").write_text(trimesh.creation.box().export(file_type="stl_ascii"))


def dae(folder: Path) -> None:
    (folder / "t.png").write_bytes(picture())
    (folder / "square.dae").write_text(DAE)
    scene = trimesh.Scene([trimesh.creation.box(), trimesh.creation.icosphere(1)])
    (folder / "scene.dae").write_bytes(trimesh.exchange.dae.export_collada(list(scene.geometry.values())))


def usdz(folder: Path) -> None:
    with zipfile.ZipFile(folder / "text.usdz", "w") as archive:
        archive.writestr("a.usda", USDA)
        archive.writestr("skin.png", picture())
    from pxr import Sdf

    Sdf.Layer.CreateAnonymous(".usda").ImportFromString(USDA)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(USDA)
    layer.Export(str(folder / "a.usdc"))
    with zipfile.ZipFile(folder / "crate.usdz", "w") as archive:
        archive.write(folder / "a.usdc", "a.usdc")
        archive.writestr("skin.png", picture())
    (folder / "a.usdc").unlink()


def meshes(folder: Path) -> None:
    for make in (glb, gltf, obj, ply, dae):
        (folder / make.__name__).mkdir()
        make(folder / make.__name__)


DAE = DOCUMENT.format(
    texture="t.png",
    nodes='<node id="leaf"><instance_geometry url="#g"/></node>',
    extra='<node id="k"><matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix><rotate>0 0 1 90</rotate>'
    '<instance_node url="#leaf"/></node>',
)

target("glb", glb, read, shared=("meshes/*.glb", "bad/*.glb"))
target(
    "gltf",
    gltf,
    lambda case: read(case if case.file.suffix == ".gltf" else Case(case.folder, case.folder / "model.gltf")),
    files=("*.gltf", "*.bin", "*.png"),
)
target("obj", obj, read, files=("*.obj",), shared=("bad/*.obj",))
target("mtl", obj, lambda case: read_mesh(case.folder / "box.obj"), files=("*.mtl", "*.png"))
target("ply", ply, read, files=("*.ply",))
target("stl", stl, read, shared=("bad/*.stl",))


def msh(folder: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    count = len(ball.vertices)
    header = np.array([count, count, 0, len(ball.faces)], "<i4").tobytes()
    vertices, normals = (np.asarray(rows, "<f4").tobytes() for rows in (ball.vertices, ball.vertex_normals))
    (folder / "ball.msh").write_bytes(header + vertices + normals + np.asarray(ball.faces, "<i4").tobytes())


def off(folder: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.05)
    lines = [f"OFF {len(ball.vertices)} {len(ball.faces)} 0", *(f"{x} {y} {z}" for x, y, z in ball.vertices)]
    lines += [f"3 {a} {b} {c} 200 30 30" for a, b, c in ball.faces]
    (folder / "ball.off").write_text("\n".join(lines) + "\n")


def three_mf(folder: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=1, radius=30)
    resources = (
        '<basematerials id="5"><base name="red" displaycolor="#FF0000"/></basematerials><m:texture2d id="6" path="/a.png"/>'
        '<m:texture2dgroup id="7" texid="6"><m:tex2coord u="0.5" v="0.5"/></m:texture2dgroup>'
        + mesh_object(1, ball, properties=['pid="5" p1="0"'] * 40 + ['pid="7" p1="0"'] * 40)
        + '<object id="2"><components><component objectid="1" transform="1 0 0 0 1 0 0 0 1 9 0 0"/></components></object>'
    )
    (folder / "ball.model").write_text(model(resources, '<item objectid="1"/><item objectid="2"/>'))
    notes = '<config><object id="1"><metadata key="extruder" value="2"/><volume firstid="0" lastid="20">'
    notes += (
        '<metadata key="volume_type" value="NegativeVolume"/></volume><part id="1" subtype="normal_part"/></object>'
    )
    (folder / "notes.config").write_text(notes + "</config>")
    (folder / "colors.config").write_text('{"filament_colour": ["#FF0000", "#00FF0080"]}')
    (folder / "whole.3mf").write_bytes(_packed(folder))


def _packed(folder: Path) -> bytes:
    """Return the archive of what lies in a folder, so that what was changed there is not only a wrong checksum."""
    beside: dict[str, str | bytes] = {
        "a.png": picture(),
        "Metadata/Slic3r_PE_model.config": (folder / "notes.config").read_bytes(),
        "Metadata/project_settings.config": (folder / "colors.config").read_bytes(),
    }
    return archive((folder / "ball.model").read_bytes(), beside)


def read_three_mf(case: Case) -> None:
    inside = [case.folder / name for name in ("ball.model", "notes.config", "colors.config")]
    if case.file.suffix != ".3mf" and all(file.is_file() and file.stat().st_size < 1 << 20 for file in inside):
        (case.folder / "whole.3mf").write_bytes(_packed(case.folder))
    read(Case(case.folder, case.folder / "whole.3mf"))


def step(folder: Path) -> None:
    (folder / "box.step").write_text(step_box((10, 20, 30), "inch"))


def fbx(folder: Path) -> None:
    (folder / "picture.png").write_bytes(picture())
    (folder / "box.fbx").write_text(fbx_box(texture="picture.png"))


def draco(folder: Path) -> None:
    data = compressed_ball()
    write_glb_of(folder / "ball.glb", document_of_ball(data), data)


target("msh", msh, read)
target("off", off, read)
target("3mf", three_mf, read_three_mf)
target("step", step, read, weight=0.3)
target("fbx", fbx, read, files=("*.fbx",), weight=0.3)
target("draco", draco, read, weight=0.1)
target("dae", dae, read, files=("*.dae",), weight=0.5)
target("usdz", usdz, read, weight=0.3)
target("survey", meshes, survey, named=True, files=("*.gltf", "*.glb", "*.obj", "*.mtl", "*.ply", "*.dae"))
