"""Materials of glTF 2.0 documents with decoded textures, and texture coordinates after KHR_texture_transform."""

from __future__ import annotations

from typing import Any

import numpy as np
from PIL import Image
from trimesh.visual.material import PBRMaterial

from manitwin.formats.meshes.gltf_document import Accessors
from manitwin.formats.meshes.source import Buffer, MeshSource
from manitwin.formats.meshes.textures import color_of_lost_texture, decode_texture, pbr_material

_NAME_CHARACTERS = 200


class GltfMaterials:
    """Materials by index, each decoded once."""

    def __init__(self, tree: dict[str, Any], accessors: Accessors, source: MeshSource):
        self._tree, self._accessors, self._source = tree, accessors, source
        self._materials: dict[int | None, PBRMaterial] = {}
        self._images: dict[int, Image.Image | None] = {}

    def material(self, index: Any) -> PBRMaterial:
        """Return material ``index``; the specification's default material for None."""
        known = _indexed(self._tree, "materials", index)
        key = index if known is not None else None
        if key not in self._materials:
            self._materials[key] = self._build(known or {})
        return self._materials[key]

    def base_texture(self, index: Any) -> dict[str, Any]:
        """Return the textureInfo of the base colour, which names the set of texture coordinates; {} without one."""
        return _base(_indexed(self._tree, "materials", index) or {})[1]

    def _build(self, entry: dict[str, Any]) -> PBRMaterial:
        pbr = entry.get("pbrMetallicRoughness", {})
        factor, base = _base(entry)
        texture = self._texture(base)
        if texture is None and base:
            factor = list(color_of_lost_texture(factor))
        metallic = float(pbr.get("metallicFactor", 1.0))
        if "metallicFactor" not in pbr and "metallicRoughnessTexture" not in pbr and self._lacks_metallic(entry):
            # trimesh writes none for materials without one (an OBJ's), which the specification interprets as metal
            self._source.add_finding("metallicFactor is missing in a file written by trimesh; taken as 0 (not metal)")
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

    def _lacks_metallic(self, entry: dict[str, Any]) -> bool:
        generator = str(self._tree.get("asset", {}).get("generator", ""))
        return "pbrMetallicRoughness" in entry and "trimesh" in generator

    def _texture(self, info: dict[str, Any]) -> Image.Image | None:
        if "index" not in info:
            return None
        texture = _indexed(self._tree, "textures", info["index"])
        if texture is None:
            self._source.add_finding("a material names a texture that is not in the file; carried on without it")
            return None
        extensions = texture.get("extensions", {})
        others = (extensions.get(name, {}).get("source") for name in ("EXT_texture_webp", "KHR_texture_basisu"))
        image = next((each for each in (texture.get("source"), *others) if each is not None), None)
        if image is None:
            self._source.add_finding("a texture names no picture of a kind that is read, and was left out")
            return None
        if image not in self._images:
            self._images[image] = self._image(image)
        return self._images[image]

    def _image(self, index: Any) -> Image.Image | None:
        entry = _indexed(self._tree, "images", index)
        if entry is None:
            self._source.add_finding("a texture names an image that is not in the file; carried on without it")
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


def texture_coordinates(info: dict[str, Any]) -> Any:
    """Return the texture coordinate set that a textureInfo names; KHR_texture_transform may override it."""
    change = info.get("extensions", {}).get("KHR_texture_transform") or {}
    return change.get("texCoord", info.get("texCoord", 0))


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
