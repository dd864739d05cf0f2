"""Conversion of USD materials to glTF's model: UsdPreviewSurface, Omniverse's OmniPBR, and the base colour of others."""

from __future__ import annotations

import posixpath
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from PIL import Image
from pxr import Sdf, Usd, UsdShade
from trimesh.visual.material import PBRMaterial

from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import (
    DEFAULT_COLOR,
    color_of_lost_texture,
    decode_texture,
    linear_to_srgb,
    pbr_material,
    srgb_to_linear,
)
from manitwin.formats.meshes.usd_shaders import (
    asset_of,
    first_number,
    kind_of,
    numbers_of,
    same_picture,
    shaders_of,
    texture_placement,
    tint_of,
    upstream,
    value_of,
)
from manitwin.formats.meshes.usdz_package import UsdzArchive

PREVIEW = "UsdPreviewSurface"
_COLORS = ("diffuse_color_constant", "base_color", "diffuseColor", "diffuse_reflection_color", "diffuse_color")
"""Base colours of OmniPBR, of MaterialX's standard_surface, open_pbr_surface and gltf_pbr, its UsdPreviewSurface, OmniSurface."""
_OMNI_PBR, _OMNI_TEXTURE, _OMNI_COLOR = "OmniPBR", "diffuse_texture", (0.2, 0.2, 0.2)
"""Omniverse's default material in MDL: prefix of its kinds, base colour texture input, and default base colour."""


@dataclass(frozen=True)
class UsdSurface:
    """A material and its texture placement: a primvar (None: the default one), and ``uv_change`` (3, 3) on the coordinates."""

    material: PBRMaterial
    uv_set: str | None = None
    uv_change: np.ndarray | None = None


class PreviewSurfaces:
    """Materials by the prim they are bound to, each built once; an unbound prim gets an unnamed grey one."""

    def __init__(self, archive: UsdzArchive, source: MeshSource):
        self._archive, self._source = archive, source
        self._materials: dict[str, UsdSurface] = {}
        self._images: dict[str, Image.Image | None] = {}

    @staticmethod
    def to_srgb(linear: np.ndarray) -> np.ndarray:
        """Convert linear colours to sRGB, clipped to 0..1."""
        return linear_to_srgb(np.clip(linear, 0, 1))

    def bound_surface(self, prim: Usd.Prim) -> UsdSurface:
        """Return the surface bound to a prim."""
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        key = str(material.GetPath()) if material else ""
        if key not in self._materials:
            grey = UsdSurface(pbr_material(base_color=DEFAULT_COLOR))
            self._materials[key] = self._build(material) if material else grey
        return self._materials[key]

    def _build(self, material: UsdShade.Material) -> UsdSurface:
        name = material.GetPrim().GetName()
        shaders = list(shaders_of(material))
        preview = next((shader for shader in shaders if shader.GetIdAttr().Get() == PREVIEW), None)
        if preview is not None:
            return self._preview(name, preview)
        for shader in shaders:
            colors = [shader.GetInput(each) for each in _COLORS if shader.GetInput(each)]
            if colors or kind_of(shader).startswith(_OMNI_PBR) or asset_of(shader.GetInput(_OMNI_TEXTURE)):
                return self._other(name, shader, colors[0] if colors else None)
        kinds = ", ".join(kind for shader in shaders if (kind := kind_of(shader)))
        self._source.add_finding(
            f"material {name!r} is no UsdPreviewSurface{f' ({kinds})' if kinds else ''}; shown grey"
        )
        return UsdSurface(pbr_material(name, base_color=DEFAULT_COLOR))

    def _preview(self, name: str, shader: UsdShade.Shader) -> UsdSurface:
        color, texture, reader = self._input(shader, "diffuseColor", (0.18, 0.18, 0.18), "rgb")
        metallic, metallic_map, _ = self._input(shader, "metallic", 0.0, "b")
        roughness, roughness_map, _ = self._input(shader, "roughness", 0.5, "g")
        _, normal_map, _ = self._input(shader, "normal", (0, 0, 1), "rgb")
        opacity, _, opacity_reader = self._input(shader, "opacity", 1.0, "a")
        packed = _packed(metallic_map, roughness_map, metallic, roughness)
        alpha = float(opacity) if 0 < float(opacity) < 1 else 1.0
        cut_out = texture is not None and texture.mode == "RGBA" and same_picture(reader, opacity_reader)
        threshold = first_number(shader, 0.0, "opacityThreshold")
        see_through = "BLEND" if alpha < 1 else None
        if cut_out:
            see_through = "MASK" if 0 < threshold < 1 else "BLEND"
        tint = tuple(color) if texture is None else tint_of(reader)
        return UsdSurface(
            pbr_material(
                name,
                base_color=(*tint, alpha),
                metallic=1.0 if packed is not None else float(metallic),
                roughness=1.0 if packed is not None else float(roughness),
                base_color_texture=texture,
                metallic_roughness_texture=packed,
                normal_texture=normal_map,
                alpha_mode=see_through,
                alpha_cutoff=threshold if see_through == "MASK" else None,
            ),
            *(texture_placement(reader) if texture is not None else (None, None)),
        )

    def _other(self, name: str, shader: UsdShade.Shader, socket: UsdShade.Input | None) -> UsdSurface:
        """Return the base colour of a surface of another kind, and the metalness and roughness of known inputs.

        Source: NVIDIA's OmniPBR.mdl: a texture replaces the constant colour, and a tint multiplies either.
        """
        color, texture = (_OMNI_COLOR, None) if socket is None else self._color_of(socket)
        named = asset_of(shader.GetInput(_OMNI_TEXTURE))
        if named is not None:
            texture = self._picture(*named)
            color = (1.0, 1.0, 1.0) if texture is not None else color_of_lost_texture(color)
        tint = numbers_of(value_of(shader.GetInput("diffuse_tint")), (1.0, 1.0, 1.0))
        share = first_number(shader, 1.0, "base")  # standard_surface: the weight of its base colour
        scale = numbers_of(value_of(shader.GetInput("texture_scale")), (1.0, 1.0))
        shift = numbers_of(value_of(shader.GetInput("texture_translate")), (0.0, 0.0))
        if first_number(shader, 0.0, "texture_rotate"):
            self._source.add_finding(f"material {name!r} turns its texture, which was not followed")
        change = np.array([[scale[0], 0, shift[0]], [0, scale[1], shift[1]], [0, 0, 1.0]])
        normals = asset_of(shader.GetInput("normalmap_texture"))
        clear = value_of(shader.GetInput("enable_opacity"))
        opacity = first_number(shader, 1.0, "opacity_constant") if clear else 1.0
        alpha = opacity if 0 < opacity < 1 else 1.0
        material = pbr_material(
            name,
            base_color=(*(np.array(color[:3]) * np.array(tint) * share), alpha),
            alpha_mode="BLEND" if alpha < 1 else None,
            metallic=first_number(shader, 0.0, "metallic_constant", "metallic", "metalness", "base_metalness"),
            roughness=first_number(shader, 0.5, "reflection_roughness_constant", "roughness", "specular_roughness"),
            base_color_texture=texture,
            normal_texture=None if normals is None else self._picture(*normals),
        )
        return UsdSurface(material, None, None if texture is None or np.allclose(change, np.eye(3)) else change)

    def _color_of(self, socket: UsdShade.Input) -> tuple[tuple[float, ...], Image.Image | None]:
        """Return an input's colour, or the picture that its upstream nodes read."""
        color = numbers_of(value_of(socket), ())
        if len(color) >= len(DEFAULT_COLOR):
            return color[: len(DEFAULT_COLOR)], None
        attributes = socket.GetValueProducingAttributes()
        named = next((found for shader in upstream(attributes) if (found := asset_of(shader.GetInput("file")))), None)
        texture = None if named is None else self._picture(*named)
        if texture is None:
            self._source.add_finding(
                f"the colour of material {socket.GetPrim().GetParent().GetName()!r} is not read; shown grey"
            )
        return (DEFAULT_COLOR if texture is None else (1.0, 1.0, 1.0)), texture

    def _input(
        self, shader: UsdShade.Shader, name: str, default: Any, channel: str
    ) -> tuple[Any, Image.Image | None, UsdShade.Shader | None]:
        """Return an input's constant, its connected texture (one channel of it for a scalar), and the texture's reader."""
        socket = shader.GetInput(name)
        if not socket:
            return default, None, None
        attributes = socket.GetValueProducingAttributes()
        producer = UsdShade.Shader(attributes[0].GetPrim()) if attributes else None
        if producer and producer.GetIdAttr().Get() == "UsdUVTexture":
            output = attributes[0].GetName().split(":")[-1]
            image = self._texture(producer)
            if image is not None and channel != "rgb":
                bands = image.split()
                place = "rgba".find(output) if len(output) == 1 else -1
                return default, bands[place] if 0 <= place < len(bands) else bands[0], producer
            lost = image is None and channel == "rgb"
            return (color_of_lost_texture(default) if lost else default), image, producer
        constant = default if isinstance(default, tuple) else (default,)
        given = numbers_of(value_of(socket), constant)
        return (given if isinstance(default, tuple) else given[0]), None, None

    def _texture(self, reader: UsdShade.Shader) -> Image.Image | None:
        named = asset_of(reader.GetInput("file"))
        return None if named is None else self._picture(*named)

    def _picture(self, layer: Sdf.Layer, path: str) -> Image.Image | None:
        """Return the picture that a layer names, or None with a finding if it is unreadable."""
        # the path is relative to the layer that wrote it; in a package, to the member's folder
        inner = layer.identifier
        inner = inner[inner.rfind("[") + 1 : -1] if inner.endswith("]") else (self._archive.root or "")
        name = path if path.startswith(("/", "\\")) else posixpath.join(posixpath.dirname(inner), path)
        return self._decoded(name, path, partial(self._archive.read, name, "texture"))

    def _decoded(self, key: str, name: str, read: Callable[[], bytes | None]) -> Image.Image | None:
        if key not in self._images:
            data = read()
            self._images[key] = None if data is None else decode_texture(data, name, self._source)
        return self._images[key]


def flat_colored(surface: UsdSurface, display: np.ndarray | None) -> PBRMaterial:
    """Return the material of a shape without texture coordinates: a texture is replaced by its mean colour.

    ``display (N, 3) uint8`` are sRGB colours of a shape without a bound material, of which the first is used.
    """
    material = surface.material
    if material.name is None:
        return material if display is None else pbr_material(base_color=tuple(srgb_to_linear(display[0] / 255)))
    if material.baseColorTexture is None:
        return material
    mean = np.asarray(material.baseColorTexture.convert("RGB").resize((1, 1), Image.Resampling.BOX))[0, 0] / 255
    plain: PBRMaterial = material.copy()
    plain.baseColorTexture = None
    factor = np.append(srgb_to_linear(mean), 1.0) * np.asarray(material.baseColorFactor, float)
    plain.baseColorFactor = np.round(factor).astype(np.uint8)
    return plain


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
