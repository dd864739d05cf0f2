"""Materials of a twin as UsdPreviewSurface networks, with their texture files."""

from __future__ import annotations

import hashlib
import io
import json
from typing import Any

import numpy as np
from PIL import Image
from pxr import Gf, Sdf, Tf, Usd, UsdShade
from trimesh.visual.material import PBRMaterial

from manitwin.formats.glb import unpack_glb
from manitwin.formats.meshes.textures import TEXTURE_FORMATS

_Types = Sdf.ValueTypeNames
_SUFFIXES = {b"\x89PNG\r\n\x1a\n": "png", b"\xff\xd8\xff": "jpg"}


class PreviewMaterials:
    """Materials below one scope, each defined once; ``textures`` holds the image files by name relative to the stage."""

    def __init__(self, stage: Usd.Stage, scope: Sdf.Path, images: GlbImages):
        self._stage, self._scope, self._images = stage, scope, images
        self._known: dict[str, UsdShade.Material] = {}
        self.textures: dict[str, bytes] = {}

    def of(self, material: PBRMaterial) -> UsdShade.Material:
        """Return the USD material for a glTF material, defining it with all inputs on first use."""
        key = _key(material)
        if key not in self._known:
            self._known[key] = self._define(material)
        return self._known[key]

    def _define(self, source: PBRMaterial) -> UsdShade.Material:
        name = unique_name(self._stage, self._scope, source.name or "material")
        path = self._scope.AppendChild(name)
        material = UsdShade.Material.Define(self._stage, path)
        surface = _shader(self._stage, path, "surface", "UsdPreviewSurface")
        material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", _Types.Token))
        factor = np.asarray(source.baseColorFactor, dtype=np.float64) / 255
        metallic, roughness = float(source.metallicFactor), float(source.roughnessFactor)
        surface.CreateInput("useSpecularWorkflow", _Types.Int).Set(0)
        color = surface.CreateInput("diffuseColor", _Types.Color3f)
        mode = source.alphaMode or "OPAQUE"
        opacity = None if mode == "OPAQUE" else surface.CreateInput("opacity", _Types.Float)
        if mode == "MASK":
            cutoff = 0.5 if source.alphaCutoff is None else float(source.alphaCutoff)  # glTF 2.0, section 5.19
            surface.CreateInput("opacityThreshold", _Types.Float).Set(cutoff)
        if source.baseColorTexture is not None:
            reader = self._texture(path, "base_color", source.baseColorTexture, "sRGB", factor)
            color.ConnectToSource(reader.CreateOutput("rgb", _Types.Float3))
            if opacity is not None:
                opacity.ConnectToSource(reader.CreateOutput("a", _Types.Float))
        else:
            color.Set(Gf.Vec3f(*factor[:3].tolist()))
            if opacity is not None:
                opacity.Set(float(factor[3]))
        metal = surface.CreateInput("metallic", _Types.Float)
        rough = surface.CreateInput("roughness", _Types.Float)
        if source.metallicRoughnessTexture is not None:
            # glTF 2.0, section 3.9.2: green is roughness, blue metalness
            scale = np.array([1.0, roughness, metallic, 1.0])
            reader = self._texture(path, "metallic_roughness", source.metallicRoughnessTexture, "raw", scale)
            metal.ConnectToSource(reader.CreateOutput("b", _Types.Float))
            rough.ConnectToSource(reader.CreateOutput("g", _Types.Float))
        else:
            metal.Set(metallic)
            rough.Set(roughness)
        if source.normalTexture is not None:
            # UsdPreviewSurface specification, "Normal": scale and bias map 8-bit textures to [-1, 1]
            reader = self._texture(path, "normal", source.normalTexture, "raw", np.array([2.0, 2.0, 2.0, 1.0]))
            reader.CreateInput("bias", _Types.Float4).Set(Gf.Vec4f(-1, -1, -1, 0))
            surface.CreateInput("normal", _Types.Normal3f).ConnectToSource(reader.CreateOutput("rgb", _Types.Float3))
        return material

    def _texture(
        self, material: Sdf.Path, role: str, image: Image.Image, space: str, scale: np.ndarray
    ) -> UsdShade.Shader:
        if not self._stage.GetPrimAtPath(material.AppendChild("st")):
            lookup = _shader(self._stage, material, "st", "UsdPrimvarReader_float2")
            lookup.CreateInput("varname", _Types.String).Set("st")
            lookup.CreateOutput("result", _Types.Float2)
        reader = _shader(self._stage, material, role, "UsdUVTexture")
        reader.CreateInput("file", _Types.Asset).Set(Sdf.AssetPath(f"./{self._file(material, role, image)}"))
        reader.CreateInput("sourceColorSpace", _Types.Token).Set(space)
        for wrap in ("wrapS", "wrapT"):
            reader.CreateInput(wrap, _Types.Token).Set("repeat")  # the default of glTF
        if not np.array_equal(scale, np.ones(4)):
            reader.CreateInput("scale", _Types.Float4).Set(Gf.Vec4f(*scale.tolist()))
        lookup = UsdShade.Shader(self._stage.GetPrimAtPath(material.AppendChild("st")))
        reader.CreateInput("st", _Types.Float2).ConnectToSource(lookup.GetOutput("result"))
        return reader

    def _file(self, material: Sdf.Path, role: str, image: Image.Image) -> str:
        data, suffix = self._images.encoded(image)
        for name, known in self.textures.items():
            if known == data:
                return name
        name = f"textures/{material.name}_{role}.{suffix}"
        self.textures[name] = data
        return name


def unique_name(stage: Usd.Stage, parent: Sdf.Path, name: str) -> str:
    """Return a valid prim name that no child of ``parent`` has."""
    valid = Tf.MakeValidIdentifier(name)
    taken = {child.GetName() for child in stage.GetPrimAtPath(parent).GetChildren()}
    number = 1
    candidate = valid
    while candidate in taken:
        number += 1
        candidate = f"{valid}_{number}"
    return candidate


def _shader(stage: Usd.Stage, material: Sdf.Path, name: str, kind: str) -> UsdShade.Shader:
    shader = UsdShade.Shader.Define(stage, material.AppendChild(name))
    shader.CreateIdAttr(kind)
    return shader


def _key(material: PBRMaterial) -> str:
    """Return a key that is equal for materials of the same appearance, which are shared."""
    images = (material.baseColorTexture, material.metallicRoughnessTexture, material.normalTexture)
    values: list[Any] = [
        material.name,
        np.asarray(material.baseColorFactor).tolist(),
        float(material.metallicFactor),
        float(material.roughnessFactor),
        material.alphaMode,
        material.alphaCutoff,
        [None if image is None else GlbImages.digest(image) for image in images],
    ]
    return json.dumps(values)


class GlbImages:
    """Encoded images of a GLB, looked up by their pixels."""

    def __init__(self, glb: bytes):
        """Read a GLB that ``formats.glb.write_glb`` wrote."""
        self._encoded: dict[str, bytes] = {}
        document, binary = unpack_glb(glb)
        for image in document.get("images", []):
            view = document["bufferViews"][image["bufferView"]]
            data = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
            decoded = Image.open(io.BytesIO(data), formats=TEXTURE_FORMATS)
            self._encoded[self.digest(decoded.convert("RGBA" if "A" in decoded.mode else "RGB"))] = data

    def encoded(self, image: Image.Image) -> tuple[bytes, str]:
        """Return the encoded image and its file suffix: the data in the GLB, or a PNG for an image from elsewhere."""
        data = self._encoded.get(self.digest(image))
        if data is None:
            stream = io.BytesIO()
            image.save(stream, "PNG", compress_level=6)
            data = stream.getvalue()
        return data, next(suffix for magic, suffix in _SUFFIXES.items() if data.startswith(magic))

    @staticmethod
    def digest(image: Image.Image) -> str:
        """Return a digest of an image's mode, size and pixels."""
        return f"{image.mode}:{image.size}:{hashlib.sha256(image.tobytes()).hexdigest()}"
