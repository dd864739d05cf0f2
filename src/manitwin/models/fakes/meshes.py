"""Meshes of the fake generators: a textured bottle in the vendors' file formats, intact or with a fault.

The files are written by trimesh and by the USD library, not by this package's own writer.
"""

from __future__ import annotations

import colorsys
import io
import json
import os
import struct
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from manitwin.models.fakes.faults import Faults

SEGMENTS = 64
TEXTURE_PX = 256
ROUGHNESS = 0.55
ZIP_TIME_S = 946_684_800  # 2000-01-01, for byte-reproducible packages
# Radius and height of a bottle of height 1, from the centre of its base to the centre of the neck's top.
BODY = ((0.0, 0.0), (0.15, 0.0), (0.165, 0.012), (0.17, 0.03), (0.17, 0.55), (0.16, 0.61), (0.12, 0.68), (0.075, 0.73))
NECK = ((0.06, 0.76), (0.06, 0.88), (0.0, 0.88))
CAP = ((0.0, 0.881), (0.07, 0.881), (0.07, 0.99), (0.062, 1.0), (0.0, 1.0))

Format = Literal["glb", "usdz"]


@dataclass(frozen=True)
class TexturedMesh:
    """A closed surface of revolution about +Y. ``uv`` has its origin at the lower left; ``texture`` is RGB uint8.

    The vertices of the first meridian are duplicated at the texture seam; the mesh is closed once equal points are merged.
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray
    texture: np.ndarray


def bottle(seed: int = 0) -> TexturedMesh:
    """Return a capped bottle, 1 high and 0.34 wide, standing on y = 0, with about 5,000 faces; the seed gives its colour."""
    return revolution("bottle", (*BODY, *NECK[:2], (0.07, 0.881), *CAP[2:]), rings=28, seed=seed)


def body_and_cap(seed: int = 0) -> list[TexturedMesh]:
    """Return the same bottle as two closed surfaces, with the cap 1/1000 above the neck."""
    return [
        revolution("body", (*BODY, *NECK), rings=30, seed=seed),
        revolution("cap", CAP, rings=8, seed=seed + 7),
    ]


def revolution(name: str, profile: tuple[tuple[float, float], ...], *, rings: int, seed: int) -> TexturedMesh:
    """Return the surface of revolution of a profile of (radius, height) whose ends lie on the axis."""
    points = np.asarray(profile)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    inner = np.unique(np.concatenate([np.linspace(0, along[-1], rings + 2)[1:-1], along[1:-1]]))
    radius, height = (np.interp(inner, along, points[:, column]) for column in (0, 1))
    angle = np.linspace(0.0, 2 * np.pi, SEGMENTS + 1)
    angle[-1] = 0.0  # the last meridian equals the first one exactly
    ring = np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=1)
    side = radius[:, None, None] * ring + np.stack([0 * height, height, 0 * height], axis=1)[:, None]
    across = np.tile(np.linspace(0, 1, SEGMENTS + 1), (len(inner), 1))
    side_uv = np.stack([across, np.tile((inner / along[-1])[:, None], (1, SEGMENTS + 1))], axis=2)
    vertices = np.vstack([side.reshape(-1, 3), [[0, points[0, 1], 0], [0, points[-1, 1], 0]]])
    uv = np.vstack([side_uv.reshape(-1, 2), [[0.5, 0.0], [0.5, 1.0]]])
    return TexturedMesh(name, vertices, _faces(len(inner)), uv, _texture(seed))


def mesh_file(format: Format, faults: Faults, seed: int = 0) -> bytes:
    """Return the file of a finished job: a bottle, modified by the first pending mesh fault."""
    whole = usdz if format == "usdz" else glb
    for fault, made in FAULTY.items():
        if faults.strike(fault):
            return made(format, seed)
    return whole([bottle(seed)])


def glb(
    surfaces: list[TexturedMesh], *, texture_format: Literal["PNG", "JPEG"] = "JPEG", up: Literal["y", "z"] = "y"
) -> bytes:
    """Return a binary glTF 2.0 of surfaces; ``up`` 'z' makes it Z-up, which violates glTF."""
    scene = trimesh.Scene()
    for surface in surfaces:
        vertices = surface.vertices if up == "y" else surface.vertices[:, [2, 0, 1]]
        image = Image.open(io.BytesIO(_image(surface.texture, texture_format)))
        material = PBRMaterial(
            name=surface.name,
            baseColorTexture=image,
            baseColorFactor=[255, 255, 255, 255],
            metallicFactor=0.0,
            roughnessFactor=ROUGHNESS,
        )
        mesh = trimesh.Trimesh(vertices, surface.faces, process=False)
        mesh.visual = TextureVisuals(uv=surface.uv, material=material)
        scene.add_geometry(mesh, node_name=surface.name, geom_name=surface.name)
    return bytes(scene.export(file_type="glb"))


def usdz(surfaces: list[TexturedMesh]) -> bytes:
    """Return a USDZ package with one mesh per surface and UsdPreviewSurface materials; Y-up, 1 unit = 1 m."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        stage = Usd.Stage.CreateNew(str(folder / "model.usdc"))
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/model").GetPrim())
        for surface in surfaces:
            (folder / f"{surface.name}.png").write_bytes(_image(surface.texture, "PNG"))
            _define_mesh(stage, surface)
        stage.GetRootLayer().Save()
        package = Sdf.ZipFileWriter.CreateNew(str(folder / "model.usdz"))
        for member in ("model.usdc", *(f"{surface.name}.png" for surface in surfaces)):
            os.utime(folder / member, (ZIP_TIME_S, ZIP_TIME_S))
            package.AddFile(str(folder / member), member)
        package.Save()
        return (folder / "model.usdz").read_bytes()


def truncated(data: bytes) -> bytes:
    """Return the first half of a file."""
    return data[: len(data) // 2]


def draco_glb(seed: int = 0) -> bytes:
    """Return a GLB whose geometry exists only as truncated KHR_draco_mesh_compression data."""

    def compress(tree: dict[str, Any], binary: bytes) -> tuple[dict[str, Any], bytes]:
        for accessor in tree["accessors"]:
            accessor.pop("bufferView", None)
            accessor.pop("byteOffset", None)
        data = b"DRACO\x02\x02\x01\x01\x00\x00" + bytes(53)  # a valid Draco 2.2 header without valid data
        tree["bufferViews"] = [{"buffer": 0, "byteOffset": 0, "byteLength": len(data)}]
        tree["buffers"] = [{"byteLength": len(data)}]
        for name in ("images", "textures", "materials", "samplers"):
            tree.pop(name, None)
        for primitive in (p for mesh in tree["meshes"] for p in mesh["primitives"]):
            primitive.pop("material", None)
            ids = {name: index for index, name in enumerate(primitive["attributes"])}
            primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": ids}}
        tree["extensionsUsed"] = tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
        return tree, data

    return _edit_glb(glb([bottle(seed)]), compress)


def webp_glb(seed: int = 0) -> bytes:
    """Return a GLB whose only texture is WebP by EXT_texture_webp."""

    def exchange(tree: dict[str, Any], binary: bytes) -> tuple[dict[str, Any], bytes]:
        (image,), (texture,) = tree["images"], tree["textures"]
        data = _image(bottle(seed).texture, "WEBP")
        tree["bufferViews"][image["bufferView"]] = {
            "buffer": 0,
            "byteOffset": len(binary),
            "byteLength": len(data),
        }
        tree["buffers"] = [{"byteLength": len(binary) + len(data)}]
        image["mimeType"] = "image/webp"
        texture["extensions"] = {"EXT_texture_webp": {"source": texture.pop("source")}}
        tree["extensionsUsed"] = tree["extensionsRequired"] = ["EXT_texture_webp"]
        return tree, binary + data

    return _edit_glb(glb([bottle(seed)]), exchange)


def open_surface(seed: int = 0) -> TexturedMesh:
    """Return 200 random faces of the bottle, one in twenty-five: an open surface that cannot be repaired to a bottle."""
    whole = bottle(seed)
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(whole.faces), 200, replace=False)
    rows = whole.faces[chosen].reshape(-1)
    return TexturedMesh(
        "scraps", whole.vertices[rows], np.arange(len(rows)).reshape(-1, 3), whole.uv[rows], whole.texture
    )


def _mesh_bytes(format: Format, surfaces: list[TexturedMesh]) -> bytes:
    return usdz(surfaces) if format == "usdz" else glb(surfaces)


# Keys are names in faults.FAULTS. GLB-specific faults give a GLB whatever format was requested.
FAULTY: dict[str, Callable[[Format, int], bytes]] = {
    "empty_mesh": lambda format, seed: b"",
    "truncated_mesh": lambda format, seed: truncated(_mesh_bytes(format, [bottle(seed)])),
    "draco_mesh": lambda format, seed: draco_glb(seed),
    "webp_texture": lambda format, seed: webp_glb(seed),
    "two_meshes": lambda format, seed: _mesh_bytes(format, body_and_cap(seed)),
    "z_up_mesh": lambda format, seed: glb([bottle(seed)], up="z"),
    "open_mesh": lambda format, seed: _mesh_bytes(format, [open_surface(seed)]),
}


def _faces(rings: int) -> np.ndarray:
    """Return outward-facing triangles of ``rings`` rings of SEGMENTS + 1 vertices and of the two poles after them."""
    row = SEGMENTS + 1
    ring, segment = np.meshgrid(np.arange(rings - 1), np.arange(SEGMENTS), indexing="ij")
    low = (ring * row + segment).reshape(-1)
    high = low + row
    sides = np.concatenate(
        [np.stack([low, low + 1, high + 1], axis=1), np.stack([low, high + 1, high], axis=1)], axis=0
    )
    first = np.arange(SEGMENTS)
    last = first + (rings - 1) * row
    bottom = np.stack([np.full(SEGMENTS, rings * row), first + 1, first], axis=1)
    top = np.stack([np.full(SEGMENTS, rings * row + 1), last, last + 1], axis=1)
    return np.concatenate([sides, bottom, top]).astype(np.int64)


def _texture(seed: int) -> np.ndarray:
    """Return a striped texture ``(TEXTURE_PX, TEXTURE_PX, 3) uint8``: a label around the middle, a band at the top."""
    hue = (0.58 + 0.13 * seed) % 1.0
    plain, label = (np.array(colorsys.hsv_to_rgb(hue, s, v)) * 255 for s, v in ((0.75, 0.7), (0.1, 0.95)))
    image = np.tile(plain, (TEXTURE_PX, TEXTURE_PX, 1))
    image[TEXTURE_PX // 2 : TEXTURE_PX * 3 // 4] = label
    image[TEXTURE_PX * 5 // 8 :: 8][:4] = plain
    image[: TEXTURE_PX // 8] = np.array(colorsys.hsv_to_rgb((hue + 0.5) % 1.0, 0.8, 0.8)) * 255
    return image.round().astype(np.uint8)


def _image(texture: np.ndarray, format: str) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(texture).save(stream, format, **({"quality": 92} if format != "PNG" else {}))
    return stream.getvalue()


def _define_mesh(stage: Usd.Stage, surface: TexturedMesh) -> None:
    mesh = UsdGeom.Mesh.Define(stage, f"/model/{surface.name}")
    mesh.CreatePointsAttr([Gf.Vec3f(*map(float, row)) for row in surface.vertices])
    mesh.CreateFaceVertexCountsAttr([3] * len(surface.faces))
    mesh.CreateFaceVertexIndicesAttr(surface.faces.reshape(-1).tolist())
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex)
    st.Set([Gf.Vec2f(*map(float, row)) for row in surface.uv])
    material = UsdShade.Material.Define(stage, f"/model/{surface.name}_material")
    shader = UsdShade.Shader.Define(stage, f"{material.GetPath()}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(ROUGHNESS)
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.0)
    reader = UsdShade.Shader.Define(stage, f"{material.GetPath()}/texture")
    reader.CreateIdAttr("UsdUVTexture")
    reader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(f"{surface.name}.png"))
    color = reader.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(color)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def _edit_glb(data: bytes, change: Callable[[dict[str, Any], bytes], tuple[dict[str, Any], bytes]]) -> bytes:
    """Return a GLB with modified JSON and binary chunks."""
    length = struct.unpack_from("<I", data, 12)[0]
    tree, binary = change(json.loads(data[20 : 20 + length]), data[28 + length :])
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    total = 12 + 8 + len(text) + 8 + len(binary)
    header = struct.pack("<4sIII4s", b"glTF", 2, total, len(text), b"JSON")
    return header + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
