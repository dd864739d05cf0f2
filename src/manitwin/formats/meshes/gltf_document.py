"""The binary side of glTF 2.0: buffers, views and accessors, every size checked before a byte is used."""

from __future__ import annotations

import base64
import binascii
import struct
from typing import Any

import numpy as np
from PIL import Image
from trimesh.visual.material import PBRMaterial

from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import Buffer, color_of_lost_texture, decode_texture, pbr_material

# glTF 2.0, section 3.6.2.2
_DTYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
_COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_NAME_CHARACTERS = 200
_GLB_JSON, _GLB_BIN = 0x4E4F534A, 0x004E4942
_REMEDY = "download or export it again"
_VALUES_PER_VERTEX = 16  # position, normal, texture coordinates, colour, and its share of the indices: 13


def split_glb(data: bytes, source: MeshSource) -> tuple[bytes, memoryview | None]:
    """Return the JSON and a view of the binary chunk of a GLB container (glTF 2.0, section 4); raises InputError."""
    if len(data) < 20:
        raise source.unreadable("the GLB ends inside its header", _REMEDY)
    _, version, length = struct.unpack_from("<III", data)
    if version != 2:
        raise source.unreadable(f"GLB version {version}, only 2 is read", "export it as glTF 2.0")
    if length > len(data):
        raise source.unreadable(f"truncated: the GLB says {length} bytes and has {len(data)}", _REMEDY)
    chunks: list[tuple[int, memoryview]] = []
    offset = 12
    while offset + 8 <= length and len(chunks) < 2:  # all that a reader may look at
        size, kind = struct.unpack_from("<II", data, offset)
        if offset + 8 + size > length:
            raise source.unreadable("a GLB chunk is longer than the file", _REMEDY)
        chunks.append((kind, memoryview(data)[offset + 8 : offset + 8 + size]))
        offset += 8 + size
    if not chunks or chunks[0][0] != _GLB_JSON:
        raise source.unreadable("the GLB has no JSON chunk", _REMEDY)
    return bytes(chunks[0][1]), next((chunk for kind, chunk in chunks[1:] if kind == _GLB_BIN), None)


class Accessors:
    """Arrays of a glTF document by accessor index; raises InputError ``unreadable`` for whatever does not add up."""

    def __init__(self, tree: dict[str, Any], binary: Buffer | None, source: MeshSource):
        self._tree, self._binary, self._source = tree, binary, source
        self._buffers: dict[int, Buffer] = {}
        self._values = 0
        self._arrays: dict[int, np.ndarray] = {}

    def array(self, index: Any) -> np.ndarray:
        """Return accessor ``index`` as ``(count, columns)``; normalised integers become float32 in -1..1."""
        position = self._checked(index, "accessors")
        if position not in self._arrays:
            self._arrays[position] = self._read(self._tree["accessors"][position])
        return self._arrays[position]

    def has_data(self, index: Any) -> bool:
        """Tell whether accessor ``index`` has data in a buffer."""
        accessor = self._tree["accessors"][self._checked(index, "accessors")]
        return "bufferView" in accessor or "sparse" in accessor

    def is_filled(self, index: Any) -> bool:
        """Tell whether accessor ``index`` has its array already."""
        return self._checked(index, "accessors") in self._arrays

    def count(self, index: Any) -> int:
        """Return how many elements accessor ``index`` says that it has."""
        return self._count(self._tree["accessors"][self._checked(index, "accessors")].get("count"))

    def fill(self, index: Any, values: np.ndarray) -> None:
        """Give accessor ``index`` the values ``(count, columns)`` that were compressed; see ``array``."""
        position = self._checked(index, "accessors")
        self._arrays[position] = _normalized(values, self._tree["accessors"][position])

    def view(self, index: Any) -> memoryview:
        """Return the bytes of buffer view ``index``."""
        view = self._tree["bufferViews"][self._checked(index, "bufferViews")]
        start, length = self._count(view.get("byteOffset", 0)), self._count(view.get("byteLength"))
        data = self._buffer(self._checked(view.get("buffer"), "buffers"))
        if start + length > len(data):
            raise self._source.unreadable(
                f"truncated: buffer view {index} ends at {start + length} of {len(data)} bytes", _REMEDY
            )
        return memoryview(data)[start : start + length]

    def uri(self, uri: str, what: str) -> bytes | None:
        """Return the bytes behind a data or file URI, or None with a finding where it leads nowhere safe."""
        if not uri.startswith("data:"):
            return self._source.sibling(uri, what)
        head, _, body = uri.partition(",")
        if not head.endswith(";base64"):
            self._source.find(f"{what} is a data URI that is not base64; carried on without it")
            return None
        try:
            return base64.b64decode(body, validate=True)
        except (binascii.Error, ValueError):
            self._source.find(f"{what} is a broken data URI; carried on without it")
            return None

    def _buffer(self, index: int) -> Buffer:
        if index not in self._buffers:
            entry = self._tree["buffers"][index]
            uri = entry.get("uri")
            data: Buffer | None = self._binary if uri is None and index == 0 else self.uri(str(uri), "buffer")
            if data is None:
                raise self._source.unreadable(
                    f"buffer {str(uri)[:80]!r} cannot be read",
                    "keep the .bin beside the .gltf, or pack both as one .glb",
                )
            declared = self._count(entry.get("byteLength"))
            if declared > len(data):
                raise self._source.unreadable(
                    f"truncated: buffer {index} says {declared} bytes and has {len(data)}", _REMEDY
                )
            self._buffers[index] = data
        return self._buffers[index]

    def _read(self, accessor: dict[str, Any]) -> np.ndarray:
        count = self._count(accessor.get("count"))
        self._source.check_vertices(count)
        kind, columns = _DTYPES.get(accessor.get("componentType", 0)), _COLUMNS.get(accessor.get("type", ""))
        if kind is None or columns is None:
            raise self._source.unreadable("an accessor has an unknown type", "export it again as glTF 2.0")
        # accessors may share a view, or have none: what they ask for is not what the file holds
        self._values += count * columns
        limit = _VALUES_PER_VERTEX * self._source.limits.max_vertices
        if self._values > limit:
            raise self._source.too_large(f"its accessors ask for more than {limit} numbers")
        dtype = np.dtype(kind).newbyteorder("<")
        if "bufferView" in accessor:
            values = self._strided(accessor["bufferView"], accessor.get("byteOffset", 0), count, columns, dtype)
        else:
            values = np.zeros((count, columns), dtype=dtype)
        if "sparse" in accessor:
            values = self._patched(values, accessor["sparse"], columns, dtype)
        return _normalized(values, accessor)

    def _strided(self, view_index: Any, offset: Any, count: int, columns: int, dtype: np.dtype) -> np.ndarray:
        data = self.view(view_index)
        row = columns * dtype.itemsize
        stride = self._count(self._tree["bufferViews"][view_index].get("byteStride", row))
        start = self._count(offset)
        if stride < row or (count and start + stride * (count - 1) + row > len(data)):
            raise self._source.unreadable(f"an accessor of {count} elements does not fit its buffer view", _REMEDY)
        strided = np.ndarray(
            (count, columns), dtype, buffer=data, offset=start if count else 0, strides=(stride, dtype.itemsize)
        )
        return np.ascontiguousarray(strided)

    def _patched(self, values: np.ndarray, sparse: dict[str, Any], columns: int, dtype: np.dtype) -> np.ndarray:
        count = self._count(sparse.get("count"))
        places, news = sparse.get("indices", {}), sparse.get("values", {})
        kind = np.dtype(_DTYPES.get(places.get("componentType", 0), np.uint32))
        if kind.kind != "u":
            raise self._source.unreadable("a sparse accessor has indices of a wrong type", _REMEDY)
        index_type = kind.newbyteorder("<")
        where = self._strided(places.get("bufferView"), places.get("byteOffset", 0), count, 1, index_type)[:, 0]
        if count and int(where.max()) >= len(values):
            raise self._source.unreadable("a sparse accessor points outside its array", _REMEDY)
        values = values.copy()
        values[where] = self._strided(news.get("bufferView"), news.get("byteOffset", 0), count, columns, dtype)
        return values

    def _checked(self, index: Any, table: str) -> int:
        if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(self._tree.get(table, [])):
            raise self._source.unreadable(f"index {str(index)[:40]} is not among its {table}", _REMEDY)
        return index

    def _count(self, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise self._source.unreadable(f"a size in it is {str(value)[:40]}, not a count", _REMEDY)
        return value


def _normalized(values: np.ndarray, accessor: dict[str, Any]) -> np.ndarray:
    if accessor.get("normalized") and values.dtype.kind in "iu":
        # section 3.6.2.2: signed values map to max(c / limit, -1)
        return np.maximum(values.astype(np.float32) / np.iinfo(values.dtype.str).max, -1.0)
    return values


class GltfMaterials:
    """Materials by index, each decoded once."""

    def __init__(self, tree: dict[str, Any], accessors: Accessors, source: MeshSource):
        self._tree, self._accessors, self._source = tree, accessors, source
        self._materials: dict[int | None, PBRMaterial] = {}
        self._images: dict[int, Image.Image | None] = {}

    def material(self, index: Any) -> PBRMaterial:
        """Return material ``index``; the default material of the specification for None."""
        known = _indexed(self._tree, "materials", index)
        key = index if known is not None else None
        if key not in self._materials:
            self._materials[key] = self._build(known or {})
        return self._materials[key]

    def base_texture(self, index: Any) -> dict[str, Any]:
        """Return the base colour's textureInfo, which names the set of texture coordinates; {} without one."""
        return _base(_indexed(self._tree, "materials", index) or {})[1]

    def _build(self, entry: dict[str, Any]) -> PBRMaterial:
        pbr = entry.get("pbrMetallicRoughness", {})
        factor, base = _base(entry)
        texture = self._texture(base)
        if texture is None and base:
            factor = list(color_of_lost_texture(factor))
        metallic = float(pbr.get("metallicFactor", 1.0))
        if "metallicFactor" not in pbr and "metallicRoughnessTexture" not in pbr and self._forgets_metallic(entry):
            # trimesh writes none for materials that came without one (an OBJ's), which the specification reads as metal
            self._source.find("metallicFactor is missing in a file written by trimesh; taken as 0 (not metal)")
            metallic = 0.0
        return pbr_material(
            None if entry.get("name") is None else str(entry["name"])[:_NAME_CHARACTERS],
            base_color=factor,
            metallic=metallic,
            roughness=float(pbr.get("roughnessFactor", 1.0)),
            base_color_texture=texture,
            metallic_roughness_texture=self._texture(pbr.get("metallicRoughnessTexture", {})),
            normal_texture=self._texture(entry.get("normalTexture", {})),
            alpha_mode=entry.get("alphaMode") if entry.get("alphaMode") in ("MASK", "BLEND") else None,
            alpha_cutoff=float(entry.get("alphaCutoff", 0.5)) if entry.get("alphaMode") == "MASK" else None,
            double_sided=bool(entry.get("doubleSided", False)),
        )

    def _forgets_metallic(self, entry: dict[str, Any]) -> bool:
        generator = str(self._tree.get("asset", {}).get("generator", ""))
        return "pbrMetallicRoughness" in entry and "trimesh" in generator

    def _texture(self, info: dict[str, Any]) -> Image.Image | None:
        if "index" not in info:
            return None
        texture = _indexed(self._tree, "textures", info["index"])
        if texture is None:
            self._source.find("a material names a texture that is not in the file; carried on without it")
            return None
        webp = texture.get("extensions", {}).get("EXT_texture_webp", {}).get("source")
        image = texture.get("source", webp)
        if image is None:
            self._source.find("a texture is only there as KTX2 (KHR_texture_basisu) and was left out")
            return None
        if image not in self._images:
            self._images[image] = self._image(image)
        return self._images[image]

    def _image(self, index: Any) -> Image.Image | None:
        entry = _indexed(self._tree, "images", index)
        if entry is None:
            self._source.find("a texture names an image that is not in the file; carried on without it")
            return None
        name = str(entry.get("name") or entry.get("uri", index))[:80]
        data: Buffer | None = self._accessors.view(entry["bufferView"]) if "bufferView" in entry else None
        if data is None and isinstance(entry.get("uri"), str):
            data = self._accessors.uri(entry["uri"], "texture")
        return (
            None
            if data is None
            else decode_texture(data, name if not name.startswith("data:") else str(index), self._source)
        )


def transformed_uv(uv: np.ndarray, info: dict[str, Any]) -> np.ndarray:
    """Apply KHR_texture_transform to texture coordinates ``(V, 2)`` in glTF's frame (origin at the upper left)."""
    change = info.get("extensions", {}).get("KHR_texture_transform")
    if not change:
        return uv
    angle = float(change.get("rotation", 0.0))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return (uv * np.asarray(change.get("scale", (1, 1)), dtype=float)) @ turn.T + np.asarray(
        change.get("offset", (0, 0)), dtype=float
    )


def _base(entry: dict[str, Any]) -> tuple[list[float], dict[str, Any]]:
    pbr = entry.get("pbrMetallicRoughness", {})
    glossy = entry.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness", {})
    if glossy and not pbr:
        return glossy.get("diffuseFactor", [1, 1, 1, 1]), glossy.get("diffuseTexture", {})
    return pbr.get("baseColorFactor", [1, 1, 1, 1]), pbr.get("baseColorTexture", {})


def _indexed(tree: dict[str, Any], table: str, index: Any) -> dict[str, Any] | None:
    entries = tree.get(table, [])
    return entries[index] if isinstance(index, int) and 0 <= index < len(entries) else None
