"""Meshes that ask for more than there is: one line and a reason, within seconds, whatever the file says of itself."""

import io
import json
import os
import signal
import struct
import subprocess
import sys
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manitwin.errors import InputError
from manitwin.formats.glb import pack_glb, write_glb
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.meshes.source import MeshLimits
from manitwin.formats.sniff import sniff
from manitwin.formats.source_files import side_files

POINTS = [(x, y, z) for x in (0, 0.04) for y in (0, 0.05) for z in (0, 0.1)]
FACES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
         (1, 5, 7), (1, 7, 3)]  # fmt: skip
BINARY = np.array(POINTS, "<f4").tobytes() + np.array(FACES, "<u2").tobytes()
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in POINTS) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES)
POSITION = {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"}
INDICES = {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}
PRIMITIVE = {"attributes": {"POSITION": 0}, "indices": 1}
FACET = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"


@pytest.fixture(autouse=True)
def a_minute_of_processor_time() -> Iterator[None]:
    """End a test that takes more: a hang, not a figure of speed."""

    def out_of_time(*_: object) -> None:
        raise TimeoutError("more than 60 CPU-seconds")

    before = signal.signal(signal.SIGPROF, out_of_time)
    signal.setitimer(signal.ITIMER_PROF, 60)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        yield
    signal.setitimer(signal.ITIMER_PROF, 0)
    signal.signal(signal.SIGPROF, before)


def glb(binary: bytes = BINARY, **changed: Any) -> bytes:
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [PRIMITIVE]}], "accessors": [POSITION, INDICES],
        "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
        "buffers": [{"byteLength": len(binary)}],
    }  # fmt: skip
    return pack_glb(tree | changed, binary + b"\0" * (-len(binary) % 4))


def zeros(count: int, kind: str = "VEC3") -> dict[str, Any]:
    """An accessor without a buffer view: zeros, as many as it says (glTF 2.0, section 3.6.2.3)."""
    return {"componentType": 5126, "count": count, "type": kind}


def png(width: int, height: int, value: int = 0) -> bytes:
    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    packer = zlib.compressobj(1)
    row = b"\0" + bytes([value]) * width
    pixels = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


def textured(*textures: bytes) -> bytes:
    """A box once a texture, each in a material of its own."""
    views, at = [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}], len(BINARY)
    for texture in textures:
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(texture)})
        at += len(texture)
    several = range(len(textures))
    return glb(
        BINARY + b"".join(textures),
        images=[{"bufferView": 2 + i} for i in several],
        textures=[{"source": i} for i in several],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}} for i in several],
        meshes=[{"primitives": [PRIMITIVE | {"material": i} for i in several]}],
        bufferViews=views,
    )


def ply(encoding: str, elements: str, body: bytes) -> bytes:
    return f"ply\nformat {encoding} 1.0\n{elements}end_header\n".encode() + body


def rows(vertices: object, faces: object, count_type: str = "uchar") -> str:
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    return f"element vertex {vertices}\n{axes}element face {faces}\nproperty list {count_type} int vertex_indices\n"


def dae(body: str, asset: str = "") -> str:
    space = 'xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"'
    return f'<?xml version="1.0"?><COLLADA {space}><asset>{asset}</asset>{body}</COLLADA>'


def dae_box(points: str | None = None, indices: str | None = None, matrix: str = "") -> str:
    points = points or " ".join(f"{x} {y} {z}" for x, y, z in POINTS)
    indices = indices or " ".join(f"{a} {b} {c}" for a, b, c in FACES)
    params = "".join(f'<param name="{axis}" type="float"/>' for axis in "XYZ")
    return (
        f'<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="24">{points}</float_array>'
        f'<technique_common><accessor source="#a" count="8" stride="3">{params}</accessor></technique_common></source>'
        '<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="12">'
        f'<input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles></mesh></geometry>'
        f'</library_geometries><library_visual_scenes><visual_scene id="s"><node>{matrix}<instance_geometry url="#g"/></node>'
        '</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene>'
    )


def usdz(*members: tuple[str, str]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, text in members:
            archive.writestr(zipfile.ZipInfo(name), text)
    return stream.getvalue()


def usda_mesh(points: str, counts: str, indices: str) -> str:
    arrays = (
        f"point3f[] points = [{points}]\nint[] faceVertexCounts = [{counts}]\nint[] faceVertexIndices = [{indices}]"
    )
    return f'#usda 1.0\ndef Mesh "m"\n{{\n{arrays}\n}}\n'


def written(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


Case = tuple[str, Callable[[], bytes | str], str, str]
REFUSED: list[Case] = [
    # sizes that the file does not have, or that pass a limit
    ("count.glb", lambda: glb(accessors=[zeros(12_000_001), INDICES]), "too_large", "vertices exceed the limit"),
    ("matrices.glb", lambda: glb(accessors=[zeros(12_000_001, "MAT4"), INDICES]), "too_large", "limit"),
    ("values.glb", lambda: glb(accessors=[*(zeros(11_000_000, "VEC4") for _ in range(9)), INDICES], meshes=[
        {"primitives": [{"attributes": {"POSITION": i}, "indices": 9} for i in range(9)]}]), "too_large", "numbers"),
    ("nodes.glb", lambda: glb(nodes=[{"mesh": 0}] * 20_001, scenes=[{"nodes": list(range(20_001))}]), "too_large", "parts"),
    ("primitives.glb", lambda: glb(meshes=[{"primitives": [PRIMITIVE] * 20_001}]), "too_large", "parts"),
    ("values.gltf", lambda: '{"asset": {"version": "2.0"}, "nodes": [' + "[]," * 5_000_001 + "[]]}", "unreadable", "values"),
    ("digits.gltf", lambda: '{"asset": {"version": "2.0"}, "nodes": [' + "9" * 10_000 + "]}", "unreadable", "JSON is broken"),
    ("lists.ply", lambda: ply("binary_little_endian", rows(8, 5_000_000), bytes(6_000_000)), "too_large", "faces"),
    ("digits.ply", lambda: ply("ascii", rows("9" * 10_000, 1), b""), "unreadable", "header is broken"),
    ("arabic.ply", lambda: ply("ascii", rows("\u0663", 1), b""), "unreadable", "header is broken"),
    ("word.ply", lambda: ply("ascii", rows(3, 1), b"0" * 10_000_000), "unreadable", "rows do not match"),
    ("size.ply", lambda: ply("ascii", rows(3, 1), b"0 " * 9 + b"99999999999 0 1 2"), "unreadable", "rows do not match"),
    ("half.ply", lambda: ply("ascii", rows(3, 1), b"0 " * 9 + b"2.5 0 1 2"), "unreadable", "rows do not match"),
    ("index.ply", lambda: ply("ascii", rows(3, 1), b"0 " * 9 + b"3 0 1 1e300"), "unreadable", "vertex that does not exist"),
    ("nan.ply", lambda: ply("ascii", rows(3, 1), b"0 " * 9 + b"3 0 1 nan"), "unreadable", "vertex that does not exist"),
    ("count.ply", lambda: ply("binary_little_endian", rows(1, 1, "float"), bytes(12) + struct.pack("<f", np.nan)),
     "unreadable", "broken"),
    ("long.ply", lambda: ply("binary_big_endian", rows(1, 1, "uint"), bytes(12) + b"\xff" * 8), "unreadable", "end early"),
    ("corners.obj", lambda: OBJ + "f " + "1 2 3 " * 140_000, "too_large", "faces exceed the limit"),
    ("points.obj", lambda: OBJ + "f 1\n" * 400_000, "too_large", "faces exceed the limit"),
    ("numbers.obj", lambda: OBJ + "v " + "0 " * 5_000_000, "unreadable", "line 21 is too long"),
    ("line.obj", lambda: OBJ + "o " + "x" * (65 << 20), "too_large", "line of more than"),
    ("groups.obj", lambda: OBJ + "".join(f"usemtl {i}\nf 1 2 3\n" for i in range(20_001)), "too_large", "parts"),
    ("index.obj", lambda: OBJ + "f 1 2 " + "9" * 10_000, "unreadable", "is not a face"),
    ("negative.obj", lambda: OBJ + "f -1 -2 -" + "9" * 30, "unreadable", "is not a face"),
    ("elements.dae", lambda: dae("<a/>" * 8_000_001), "too_large", "elements"),
    ("archive.dae", lambda: dae("<a>\u4b50\u0605</a>").replace("?>", ' encoding="utf-16"?>', 1).encode("utf-16"),
     "unreadable", "contains a ZIP archive"),
    ("members.usdz", lambda: usdz(("a.usda", "#usda 1.0\n"), *((f"{i}", "") for i in range(10_000))), "too_large", "members"),
    ("counts.usdz", lambda: usdz(("a.usda", usda_mesh("(0,0,0)", "-3, 6", "0,0,0"))), "unreadable", "do not match"),
    ("huge.usdz", lambda: usdz(("a.usda", usda_mesh("(0,0,0)", "2000000000", "0"))), "unreadable", "do not match"),
    # indices and numbers that are none
    ("signed.glb", lambda: glb(accessors=[POSITION, INDICES | {"componentType": 5122}]), "unreadable", "unsigned"),
    ("float.glb", lambda: glb(accessors=[POSITION, POSITION | {"type": "SCALAR"}]), "unreadable", "unsigned"),
    ("scale.glb", lambda: glb(nodes=[{"mesh": 0, "scale": [1e300] * 3}]), "not_finite", "farther out"),
    ("nested.glb", lambda: glb(nodes=[{"children": [1], "scale": [1e200] * 3}, {"mesh": 0, "scale": [1e200] * 3}]),
     "not_finite", "NaN or infinite"),
    ("far.obj", lambda: OBJ.replace("0.1", "1e300"), "not_finite", "farther out"),
    ("plain.obj", lambda: "v 0 0 0\nv 1e200 0 0\nv 0 1 0\nf 1 2 3\n", "not_finite", "farther out"),
    ("far.stl", lambda: "solid x\n" + FACET.replace("1 0 0", "1e400 nan 0"), "not_finite", "NaN or infinite"),
    ("matrix.dae", lambda: dae(dae_box(matrix=f"<matrix>{'1e300 ' * 16}</matrix>")), "not_finite", "vertices"),
    ("index.dae", lambda: dae(dae_box(indices="0 1 999999 " * 12)), "no_faces", "no readable faces"),
    ("negative.dae", lambda: dae(dae_box(indices="0 1 -9 " * 12)), "unreadable", "broken"),
    ("far.usdz", lambda: usdz(("a.usda", usda_mesh("(0,0,1e30),(1,0,0),(0,1,0)", "3", "0,1,2"))), "not_finite", "farther out"),
]  # fmt: skip


FEWER_FACES = MeshLimits(max_faces=400_000)
"""So that no case takes seconds to count to the limit."""


@pytest.mark.parametrize(("name", "content", "reason", "said"), REFUSED, ids=[case[0] for case in REFUSED])
def test_what_asks_for_too_much_is_refused_in_one_line(
    tmp_path: Path, name: str, content: Callable[[], bytes | str], reason: str, said: str
) -> None:
    path = written(tmp_path, name, content())
    with pytest.raises(InputError) as caught:
        read_mesh(path, limits=FEWER_FACES if name in ("corners.obj", "points.obj") else MeshLimits())
    assert (caught.value.reason, said in caught.value.detail) == (reason, True), caught.value.detail
    assert caught.value.detail.startswith(f"{name}: ") and len(caught.value.detail) < 600
    assert caught.value.detail.isprintable()


AWKWARD: list[tuple[str, Callable[[int], bytes | str]]] = [
    ("blank.obj", lambda n: OBJ + "\n" * n),
    ("returns.obj", lambda n: OBJ + "\r" * n),
    ("spaces.obj", lambda n: "mtllib a" + " " * n + "b\n" + OBJ),
    ("libraries.obj", lambda n: OBJ + "mtllib " * (n // 7)),
    ("joined.obj", lambda n: OBJ + "\\\n" * (n // 2)),
    ("digits.obj", lambda n: "v 0 0 " + "1" * n + "x\n" + OBJ),
    ("comment.obj", lambda n: "#" + " \t" * (n // 2) + "\n" + OBJ),
    ("blank.stl", lambda n: "solid x\n" + FACET + "\n" * n + "endsolid\n"),
    ("spaces.stl", lambda n: "solid x\n" + FACET + " " * n + "\nendsolid\n"),
    ("vertices.stl", lambda n: "solid x\n" + FACET + "vertex " * (n // 7)),
    ("texture.dae", lambda n: dae("<init_from>" + " " * n + "</init_from>" + dae_box())),
    ("comment.dae", lambda n: dae(dae_box()) + "<!-- <init_from>" + " " * n + "-->"),
    ("textures.dae", lambda n: dae("<init_from>a</init_from>" * (n // 24) + dae_box())),
    ("header.ply", lambda n: "ply\nend_header" + " " * n + "x\n" + "end_header \t" * (n // 12)),
    ("comment.ply", lambda n: "ply\ncomment TextureFile " + " " * n + "\n"),
    ("asset.gltf", lambda n: '{"asset"' + " " * n + '"asset"' + " \n" * n + "}"),
    ("collada.dae", lambda n: "<" + "a" * n + "<" * n + "COLLADA"),
    ("solid.stl", lambda n: "solid" + " " * n + "facet " * (n // 6)),
]


@pytest.mark.parametrize("length", [3_000, 1_000_000])
@pytest.mark.parametrize(("name", "content"), AWKWARD, ids=[name for name, _ in AWKWARD])
def test_long_runs_of_awkward_characters_take_no_time(
    tmp_path: Path, name: str, content: Callable[[int], bytes | str], length: int
) -> None:
    path = written(tmp_path, name, content(length))
    side_files(path)
    try:
        sniff(path)
        read_mesh(path)
    except InputError as error:
        assert error.detail.isprintable() and len(error.detail) < 600


def test_one_texture_of_many_materials_is_decoded_once(tmp_path: Path) -> None:
    mesh = read_mesh(written(tmp_path, "a.glb", textured(*[png(300, 200)] * 40)))
    images = {id(part.visual.material.baseColorTexture) for part in mesh.parts}
    assert len(mesh.parts) == 40 and len(images) == 1


def test_all_textures_together_have_a_limit_of_pixels(tmp_path: Path) -> None:
    path = written(tmp_path, "a.glb", textured(*(png(100, 100, i) for i in range(9))))
    assert len(read_mesh(path, limits=MeshLimits(max_texture_pixels=11_250)).parts) == 9
    with pytest.raises(InputError, match=r"^too_large: .* more than 80000 pixels together; scale them down"):
        read_mesh(path, limits=MeshLimits(max_texture_pixels=10_000))


def test_parts_that_share_an_array_of_vertices_keep_those_that_they_use(tmp_path: Path) -> None:
    path = written(
        tmp_path, "a.glb", glb(accessors=[zeros(1_000_000), INDICES], meshes=[{"primitives": [PRIMITIVE] * 30}])
    )
    parts = read_mesh(path).parts
    assert len(parts) == 30 and sum(len(part.vertices) for part in parts) < 12_000_000


def test_numbers_of_materials_that_are_none_do_not_reach_the_glb(tmp_path: Path) -> None:
    material = {
        "name": {"a": 1}, "alphaMode": "MASK", "alphaCutoff": 1e300,
        "pbrMetallicRoughness": {"baseColorFactor": [1e300, -1e300, 0, 1], "metallicFactor": 1e308, "roughnessFactor": -1},
    }  # fmt: skip
    uv = {"bufferView": 2, "componentType": 5126, "count": 8, "type": "VEC2"}
    numbers = np.array([np.nan, np.inf, 3e38, 1] * 4, "<f4").tobytes()
    views = [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72},
             {"buffer": 0, "byteOffset": 168, "byteLength": 64}]  # fmt: skip
    primitive = {"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, "material": 0}
    path = written(tmp_path, "a.glb", glb(
        BINARY + numbers, accessors=[POSITION, INDICES, uv], materials=[material], bufferViews=views,
        meshes=[{"primitives": [primitive]}]))  # fmt: skip
    parts = read_mesh(path).parts
    assert np.isfinite(parts[0].visual.uv).all()
    assert b"NaN" not in write_glb(parts) and b"Infinity" not in write_glb(parts)
    (tmp_path / "m.mtl").write_text("newmtl m\nKd nan inf 1e400\nNs nan\nPm nan\nPr inf\nd nan\n")
    write_glb(read_mesh(written(tmp_path, "a.obj", "mtllib m.mtl\nusemtl m\n" + OBJ)).parts)


@pytest.mark.parametrize("unit", ["1e300", "1e-320", "nan", "-1", "0"])
def test_a_unit_that_is_none_is_not_used(tmp_path: Path, unit: str) -> None:
    path = written(tmp_path, "a.dae", dae(dae_box(), f'<unit meter="{unit}"/>'))
    assert read_mesh(path).unit_m is None


@pytest.mark.parametrize("length", ["1e-300", "4e-320", "-0"])
def test_tiny_and_flat_meshes_are_read_without_a_warning(tmp_path: Path, length: str) -> None:
    assert read_mesh(written(tmp_path, "a.obj", OBJ.replace("0.1", length))).parts
    assert read_mesh(
        written(tmp_path, "b.obj", OBJ.replace("0.", f"{length}0 #")[:0] + "v 1 1 1\n" * 3 + "f 1 2 3\n")
    ).parts


@pytest.mark.parametrize(
    "kind", ["pipe", "device", "link to a device", "link out", "loop", "folder", "long name", "lone half"]
)
def test_only_regular_files_of_the_folder_are_read_for_a_mesh(tmp_path: Path, kind: str) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (tmp_path / "secret.mtl").write_text("newmtl m\nKd 1 0 0\n")
    name = {"long name": "a" * 100_000, "device": "/dev/zero", "lone half": "\udc80.mtl"}.get(kind, "m.mtl")
    if kind == "pipe":
        os.mkfifo(folder / name)
    elif kind == "folder":
        (folder / name).mkdir()
    elif kind in ("link to a device", "link out", "loop"):
        (folder / name).symlink_to({"loop": name, "link out": "../secret.mtl"}.get(kind, "/dev/zero"))
    path = written(folder, "a.obj", f"{OBJ}mtllib {name}\nusemtl m\nf 1 2 4\n".encode(errors="surrogateescape"))
    mesh = read_mesh(path)
    assert sum(len(part.faces) for part in mesh.parts) == 13 and side_files(path) == []
    assert any("material library" in finding for finding in mesh.findings)
    assert all(finding.isprintable() and len(finding) < 500 for finding in mesh.findings)


@pytest.mark.parametrize("name", ["a.glb", "a.gltf", "a.obj", "a.stl", "a.ply", "a.dae", "a.usdz"])
def test_a_sparse_file_is_refused_by_its_size(tmp_path: Path, name: str) -> None:
    begin = {"a.glb": b"glTF\2\0\0\0", "a.gltf": b'{"asset": {}, "nodes": []', "a.obj": OBJ.encode(),
             "a.stl": b"solid x\nfacet\n", "a.ply": b"ply\nformat ascii 1.0\n", "a.dae": dae("").encode(),
             "a.usdz": usdz(("a.usda", "#usda 1.0"))}  # fmt: skip
    path = written(tmp_path, name, begin[name])
    os.truncate(path, 6 << 30)
    side_files(path)
    with pytest.raises(InputError, match=rf"^(too_large|wrong_type|unreadable): {name}: "):
        read_mesh(path)


@pytest.mark.slow
def test_what_passes_the_processs_memory_is_too_large_in_one_line(tmp_path: Path) -> None:
    """In a process of 1.5 GB: nine textures of 64 megapixels, of which eight are within the limits."""
    written(tmp_path, "textures.glb", textured(*(png(8000, 8000, i) for i in range(8))))
    written(
        tmp_path, "accessor.glb", glb(accessors=[zeros(11_000_000), INDICES], meshes=[{"primitives": [PRIMITIVE] * 50}])
    )
    program = (
        "import resource, sys; from pathlib import Path\n"
        "from manitwin.errors import InputError; from manitwin.formats.meshes.read import read_mesh\n"
        "resource.setrlimit(resource.RLIMIT_AS, (3 << 29, 3 << 29))\n"
        "for name in sys.argv[1:]:\n"
        "    try: print(name, len(read_mesh(Path(name)).parts))\n"
        "    except InputError as error: print(error)\n"
    )
    said = subprocess.run(
        [sys.executable, "-c", program, "textures.glb", "accessor.glb"], cwd=tmp_path, capture_output=True, text=True
    )
    lines = said.stdout.splitlines()
    assert (said.returncode, said.stderr, len(lines)) == (0, "", 2)
    assert (
        lines[0] == "too_large: textures.glb: it needs more memory than is available; simplify it, or raise the limit"
    )
    assert lines[1] == "accessor.glb 50" or lines[1].startswith("too_large: accessor.glb: ")


def test_deep_json_is_one_line(tmp_path: Path) -> None:
    for name, text in (
        ("a.gltf", '{"asset": {"version": "2.0"}, "meshes": ' + "[" * 200_000),
        ("b.glb", json.dumps({})),
    ):
        with pytest.raises(InputError, match=rf"{name}: "):
            read_mesh(written(tmp_path, name, text))
