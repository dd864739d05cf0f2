"""Reading and writing of visual parts as binary glTF 2.0; writing is deterministic."""

from __future__ import annotations

import hashlib
import io
import json
import struct
from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial

from manitwin.formats.meshes.gltf import read_gltf
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.formats.meshes.textures import bake_transform, make_part, material_of, normals_of, uv_of
from manitwin.geometry.poses import GLTF_TO_OBJECT, OBJECT_TO_GLTF
from manitwin.geometry.seams import close_seams, has_distinct_corners

_FLOAT, _UINT16, _UINT32 = 5126, 5123, 5125  # glTF 2.0, section 3.6.2.2
_ARRAY_BUFFER, _ELEMENT_BUFFER = 34962, 34963
_COLOR_QUALITY = 90  # visually lossless for photographs, about a fifth of the size of a PNG
_DATA_QUALITY = 95  # normals and roughness are numbers: coarser steps appear as facets in highlights


def write_glb(parts: list[trimesh.Trimesh], *, max_texture_size: int = 2048) -> bytes:
    """Return visual parts in the object frame (Z-up, metres) as a Y-up GLB.

    Names, normals, texture coordinates and the PBR material of each part are kept. Textures are scaled down to
    ``max_texture_size`` pixels on the longer side; opaque ones become JPEG, those with used alpha PNG. Seams of textures and
    creases are closed by degenerate triangles (``geometry.seams``), so that a watertight part stays watertight for tools that
    compare indices.

    Source: glTF 2.0 specification, Khronos Group 2021.
    """
    document = _Document(max_texture_size)
    for index, part in enumerate(parts):
        document.add(part, str(part.metadata.get("name") or f"part_{index:02d}"))
    return document.data()


def read_glb(path: Path, *, limits: MeshLimits | None = None) -> list[trimesh.Trimesh]:
    """Read the parts of a GLB into the object frame (Z-up, metres); raises InputError like ``read_mesh``.

    Degenerate triangles that close seams are removed.
    """
    parts = read_gltf(MeshSource(path, limits or MeshLimits()), binary=True)
    return [bake_transform(_without_seam_faces(part), GLTF_TO_OBJECT) for part in parts]


def pack_glb(tree: dict[str, Any], binary: bytes) -> bytes:
    """Return a GLB container of a document and its only buffer (glTF 2.0, section 4)."""
    text = json.dumps(tree, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if binary:
        chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def unpack_glb(glb: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the document and the buffer of a GLB that ``pack_glb`` wrote."""
    (length,) = struct.unpack_from("<I", glb, 12)
    return json.loads(glb[20 : 20 + length]), glb[28 + length :]


def _without_seam_faces(part: trimesh.Trimesh) -> trimesh.Trimesh:
    keep = has_distinct_corners(np.asarray(part.vertices), np.asarray(part.faces))
    if keep.all():
        return part
    return make_part(
        part.vertices,
        part.faces[keep],
        material=material_of(part),
        name=str(part.metadata["name"]),
        uv=uv_of(part),
        normals=normals_of(part),
    )


class _Document:
    """A glTF document under construction: its JSON tables and its only buffer."""

    def __init__(self, max_texture_size: int):
        self._max_texture_size = max_texture_size
        self._tables: dict[str, list[dict[str, Any]]] = {}
        self._chunks: list[bytes] = []
        self._length = 0
        self._known: dict[str, int] = {}
        self._numbers: dict[int, tuple[Image.Image, int]] = {}  # many materials may show one image
        self._first: dict[str, Image.Image] = {}  # by mode and size
        self._digests: dict[str, dict[str, int]] = {}  # by mode and size

    def add(self, part: trimesh.Trimesh, name: str) -> None:
        """Append a part as a mesh with one primitive, under its own node."""
        turned = bake_transform(part, OBJECT_TO_GLTF)
        # coincidence of vertices is decided in the precision of the file
        positions = np.asarray(turned.vertices, dtype="<f4")
        source, faces = close_seams(positions, np.asarray(turned.faces))
        attributes = {
            "POSITION": self._vectors(positions[source], bounds=True),
            "NORMAL": self._vectors(_unit_normals(turned)[source]),
        }
        uv = uv_of(part)
        if uv is not None:
            attributes["TEXCOORD_0"] = self._vectors(np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])[source])
        primitive = {
            "attributes": attributes,
            "indices": self._indices(faces, len(source)),
            "material": self._material(material_of(part)),
            "mode": 4,
        }
        mesh = self._append("meshes", {"name": name, "primitives": [primitive]})
        self._append("nodes", {"name": name, "mesh": mesh})

    def data(self) -> bytes:
        """Return the GLB container."""
        nodes = list(range(len(self._tables.get("nodes", []))))
        tree: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "manitwin"},
            "scene": 0,
            "scenes": [{"nodes": nodes} if nodes else {}],
            **self._tables,
        }
        if self._length:
            tree["buffers"] = [{"byteLength": self._length}]
        return pack_glb(tree, b"".join(self._chunks))

    def _append(self, table: str, entry: dict[str, Any]) -> int:
        entries = self._tables.setdefault(table, [])
        entries.append(entry)
        return len(entries) - 1

    def _view(self, data: bytes, target: int | None = None) -> int:
        view: dict[str, Any] = {"buffer": 0, "byteOffset": self._length, "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        padded = data + b"\0" * (-len(data) % 4)
        self._chunks.append(padded)
        self._length += len(padded)
        return self._append("bufferViews", view)

    def _vectors(self, rows: np.ndarray, bounds: bool = False) -> int:
        values = np.ascontiguousarray(rows, dtype="<f4")
        accessor: dict[str, Any] = {
            "bufferView": self._view(values.tobytes(), _ARRAY_BUFFER),
            "componentType": _FLOAT,
            "count": len(values),
            "type": f"VEC{values.shape[1]}",
        }
        if bounds:
            accessor |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
        return self._append("accessors", accessor)

    def _indices(self, faces: np.ndarray, vertices: int) -> int:
        # 65535 is the restart value of 16-bit indices
        kind, dtype = (_UINT16, "<u2") if vertices < 65535 else (_UINT32, "<u4")
        view = self._view(np.ascontiguousarray(faces, dtype=dtype).tobytes(), _ELEMENT_BUFFER)
        return self._append(
            "accessors", {"bufferView": view, "componentType": kind, "count": int(faces.size), "type": "SCALAR"}
        )

    def _material(self, material: PBRMaterial) -> int:
        factor = np.asarray(material.baseColorFactor) / 255
        mode = material.alphaMode or "OPAQUE"
        pbr: dict[str, Any] = {
            "baseColorFactor": [round(float(c), 6) for c in factor],
            "metallicFactor": float(material.metallicFactor),
            "roughnessFactor": float(material.roughnessFactor),
        }
        entry: dict[str, Any] = {"name": material.name or "material", "pbrMetallicRoughness": pbr, "alphaMode": mode}
        if material.doubleSided:
            entry["doubleSided"] = True
        if mode == "MASK" and material.alphaCutoff is not None:
            entry["alphaCutoff"] = float(material.alphaCutoff)
        if material.baseColorTexture is not None:
            pbr["baseColorTexture"] = {"index": self._texture(material.baseColorTexture, "color", mode != "OPAQUE")}
        if material.metallicRoughnessTexture is not None:
            pbr["metallicRoughnessTexture"] = {"index": self._texture(material.metallicRoughnessTexture, "data", False)}
        if material.normalTexture is not None:
            entry["normalTexture"] = {"index": self._texture(material.normalTexture, "data", False)}
        key = "material:" + json.dumps(entry, sort_keys=True)
        if key not in self._known:
            self._known[key] = self._append("materials", entry)
        return self._known[key]

    def _texture(self, image: Image.Image, kind: Literal["color", "data"], with_alpha: bool) -> int:
        number = self._number(image)
        key = f"texture:{kind}:{with_alpha}:{number}"
        if key not in self._known:
            data, mime = _encoded(_fitted(image, self._max_texture_size), kind, with_alpha)
            source = self._append("images", {"bufferView": self._view(data), "mimeType": mime})
            self._known[key] = self._append("textures", {"source": source})
        return self._known[key]

    def _number(self, image: Image.Image) -> int:
        """Return the number shared by images with equal pixels; pixels are hashed only if mode and size recur."""
        if id(image) not in self._numbers:
            number, group = len(self._numbers), f"{image.mode}:{image.size}"
            first = self._first.setdefault(group, image)
            if first is not image:  # hashing the pixels of a scan takes longer than writing everything else
                known = self._digests.setdefault(group, {_digest(first): self._numbers[id(first)][1]})
                number = known.setdefault(_digest(image), number)
            self._numbers[id(image)] = image, number
        return self._numbers[id(image)][1]


def _digest(image: Image.Image) -> str:
    return hashlib.sha256(image.tobytes()).hexdigest()


def _fitted(image: Image.Image, longest: int) -> Image.Image:
    """Return the image with at most ``longest`` pixels on its longer side."""
    over = max(image.size) / longest
    if over <= 1:
        return image
    if over.is_integer() and all(side % int(over) == 0 for side in image.size):
        return image.reduce(int(over))  # a plain mean, many times faster than a filter
    width, height = (max(round(side / over), 1) for side in image.size)
    return image.resize((width, height), Image.Resampling.LANCZOS)


def _encoded(image: Image.Image, kind: Literal["color", "data"], with_alpha: bool) -> tuple[bytes, str]:
    stream = io.BytesIO()
    if with_alpha and image.mode == "RGBA":
        image.save(stream, "PNG", compress_level=6)
        return stream.getvalue(), "image/png"
    quality = _COLOR_QUALITY if kind == "color" else _DATA_QUALITY
    # no chroma subsampling, which blurs edges at texture seams and in painted vertex colours
    opaque = image if image.mode == "RGB" else image.convert("RGB")
    opaque.save(stream, "JPEG", quality=quality, subsampling=0)
    return stream.getvalue(), "image/jpeg"


def _unit_normals(part: trimesh.Trimesh) -> np.ndarray:
    """Return unit vertex normals ``(V, 3)``, as glTF requires; +Z where the faces define none."""
    normals = np.array(part.vertex_normals, dtype=np.float64)
    lengths = np.linalg.norm(normals, axis=1)
    normals[lengths < 1e-6] = (0.0, 0.0, 1.0)
    return normals / np.where(lengths < 1e-6, 1.0, lengths)[:, None]
