"""UsdPreviewSurface materials of USDZ packages."""

from __future__ import annotations

import posixpath
from typing import Any

import numpy as np
from PIL import Image
from pxr import Usd, UsdShade
from trimesh.visual.material import PBRMaterial

from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import decode_texture, linear_to_srgb, pbr_material
from manitwin.formats.meshes.usdz_archive import UsdzArchive


class PreviewSurfaces:
    """Materials by the prim that they are bound to, each built once; an unbound prim gets a nameless grey one."""

    def __init__(self, archive: UsdzArchive, source: MeshSource):
        self._archive, self._source = archive, source
        self._materials: dict[str, PBRMaterial] = {}
        self._images: dict[str, Image.Image | None] = {}

    @staticmethod
    def to_srgb(linear: np.ndarray) -> np.ndarray:
        """Convert linear colours to sRGB, clipped to 0..1."""
        return linear_to_srgb(np.clip(linear, 0, 1))

    def of(self, prim: Usd.Prim) -> PBRMaterial:
        """Return the material bound to a prim."""
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        key = str(material.GetPath()) if material else ""
        if key not in self._materials:
            self._materials[key] = self._build(material) if material else pbr_material(base_color=(0.8, 0.8, 0.8))
        return self._materials[key]

    def _build(self, material: UsdShade.Material) -> PBRMaterial:
        name = material.GetPrim().GetName()
        shader, _, _ = material.ComputeSurfaceSource()
        if not shader or shader.GetIdAttr().Get() != "UsdPreviewSurface":
            self._source.find(f"material {name!r} is no UsdPreviewSurface; shown grey")
            return pbr_material(name, base_color=(0.8, 0.8, 0.8))
        color, texture = self._input(shader, "diffuseColor", (0.18, 0.18, 0.18), "rgb")
        metallic, metallic_map = self._input(shader, "metallic", 0.0, "b")
        roughness, roughness_map = self._input(shader, "roughness", 0.5, "g")
        _, normal_map = self._input(shader, "normal", (0, 0, 1), "rgb")
        opacity, _ = self._input(shader, "opacity", 1.0, "a")
        packed = _packed(metallic_map, roughness_map, metallic, roughness)
        alpha = float(opacity) if 0 < float(opacity) < 1 else 1.0
        return pbr_material(
            name,
            base_color=(*((1.0, 1.0, 1.0) if texture is not None else tuple(color)), alpha),
            metallic=1.0 if packed is not None else float(metallic),
            roughness=1.0 if packed is not None else float(roughness),
            base_color_texture=texture,
            metallic_roughness_texture=packed,
            normal_texture=normal_map,
            alpha_mode="BLEND" if alpha < 1 else None,
        )

    def _input(self, shader: UsdShade.Shader, name: str, default: Any, channel: str) -> tuple[Any, Image.Image | None]:
        """Return an input's constant, and the texture that it is connected to (one channel of it for a scalar)."""
        socket = shader.GetInput(name)
        if not socket:
            return default, None
        attributes = socket.GetValueProducingAttributes()
        producer = UsdShade.Shader(attributes[0].GetPrim()) if attributes else None
        if producer and producer.GetIdAttr().Get() == "UsdUVTexture":
            output = attributes[0].GetName().split(":")[-1]
            image = self._texture(producer, attributes[0].GetStage())
            if image is not None and channel != "rgb":
                bands = image.split()
                return default, bands["rgba".index(output)] if output in "rgba" and "rgba".index(output) < len(
                    bands
                ) else bands[0]
            return default, None if image is None or channel != "rgb" else image
        value = attributes[0].Get() if attributes else socket.Get()
        return (default if value is None else value), None

    def _texture(self, reader: UsdShade.Shader, stage: Usd.Stage) -> Image.Image | None:
        socket = reader.GetInput("file")
        attributes = socket.GetValueProducingAttributes() if socket else []
        asset = attributes[0].Get() if attributes else None
        if asset is None or not asset.path:
            return None
        # the path counts from the layer that wrote it; in a package that is the member's own folder
        layer = attributes[0].GetPropertyStack(Usd.TimeCode.Default())[0].layer.identifier
        inner = layer[layer.rfind("[") + 1 : -1] if layer.endswith("]") else (self._archive.root or "")
        name = (
            asset.path if asset.path.startswith(("/", "\\")) else posixpath.join(posixpath.dirname(inner), asset.path)
        )
        if name not in self._images:
            data = self._archive.read(name, "texture")
            self._images[name] = None if data is None else decode_texture(data, asset.path, self._source)
        return self._images[name]


def _packed(
    metallic: Image.Image | None, roughness: Image.Image | None, metallic_factor: Any, roughness_factor: Any
) -> Image.Image | None:
    """Return glTF's packed texture (green: roughness, blue: metallic), or None without either map."""
    if metallic is None and roughness is None:
        return None
    size = (roughness or metallic).size  # type: ignore[union-attr]
    green = (
        Image.new("L", size, round(float(roughness_factor) * 255))
        if roughness is None
        else roughness.convert("L").resize(size)
    )
    blue = (
        Image.new("L", size, round(float(metallic_factor) * 255))
        if metallic is None
        else metallic.convert("L").resize(size)
    )
    return Image.merge("RGB", (Image.new("L", size, 255), green, blue))
