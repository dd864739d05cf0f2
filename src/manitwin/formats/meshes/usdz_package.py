"""The archive side of USDZ: members, and a check that no layer in it reaches outside of it."""

from __future__ import annotations

import posixpath
import re
import zipfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from pxr import Sdf, Tf, Usd, UsdShade
from trimesh.visual.material import PBRMaterial

from manitwin.errors import InputError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import (
    DEFAULT_COLOR,
    color_of_lost_texture,
    decode_texture,
    linear_to_srgb,
    pbr_material,
)

_LAYERS = (".usd", ".usda", ".usdc")
_MAX_MEMBERS = 10_000
_CENTRAL_HEADER = b"PK\x01\x02"
_BLOCK_BYTES = 1 << 20


class UsdzArchive:
    """The members of a USDZ package by name, without ever unpacking them to disk."""

    def __init__(self, source: MeshSource):
        self._source = source
        size = source.path.stat().st_size
        if size > source.limits.max_bytes:
            raise source.too_large(f"{size} bytes are more than the limit of {source.limits.max_bytes}")
        members_said = _central_headers(source)
        if members_said > _MAX_MEMBERS:  # before a list of them is made
            raise source.too_large(f"{members_said} members in the archive", "pack fewer files")
        try:
            self._zip = zipfile.ZipFile(source.path)
            members = self._zip.infolist()
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
            raise source.unreadable(
                f"truncated or broken: its archive cannot be read ({str(error)[:60]})", "download it again"
            ) from error
        for member in members:
            # USDZ allows neither compression nor encryption, which leaves nothing for a ZIP bomb to do
            if (
                member.compress_type != zipfile.ZIP_STORED
                or member.flag_bits & 1
                or member.file_size != member.compress_size
            ):
                raise source.unreadable(
                    f"member {member.filename[:80]!r} is compressed or encrypted, which USDZ forbids",
                    "pack it with usdzip",
                )
            if not _is_inside(member.filename):
                raise source.unreadable(
                    f"member {member.filename[:80]!r} leads out of the archive", "pack it with usdzip"
                )
        if sum(member.file_size for member in members) > size:
            raise source.unreadable("its members overlap", "pack it with usdzip")
        self.names = [member.filename for member in members]
        self.root = self.names[0] if self.names and self.names[0].lower().endswith(_LAYERS) else None

    def read(self, name: str, what: str) -> bytes | None:
        """Return a member's bytes, or None with a finding; nothing outside the archive is ever opened."""
        clean = posixpath.normpath(name.replace("\\", "/"))
        if not _is_inside(clean):
            self._source.find(f"{what} {name[:80]!r} lies outside the archive and was not read")
            return None
        if clean not in self.names:
            self._source.find(f"{what} {name[:80]!r} is not in the archive; carried on without it")
            return None
        try:
            return self._zip.read(clean)
        except (zipfile.BadZipFile, OSError, EOFError):
            self._source.find(f"{what} {name[:80]!r} is broken; carried on without it")
            return None

    def check_layers(self) -> None:
        """Refuse a package with a layer that names a layer outside of it; raises InputError ``unreadable``.

        Every layer of the archive is looked at, used or not, before a stage is composed: composing would open what they
        name.
        """
        for name in self.names:
            if not name.lower().endswith(_LAYERS):
                continue
            try:
                layer = Sdf.Layer.OpenAsAnonymous(package_path(self._source.path, name))
                named_layers = [] if layer is None else layer.GetCompositionAssetDependencies()
                clips = layer is not None and _has_clips(layer)
            except Tf.ErrorException as error:
                raise self._source.unreadable(f"layer {name[:80]!r} cannot be read", "export it again") from error
            if layer is None:
                raise self._source.unreadable(f"layer {name[:80]!r} cannot be read", "export it again")
            for named in named_layers:
                target = posixpath.normpath(posixpath.join(posixpath.dirname(name), named))
                if (not _is_inside(named) and named) or not _is_inside(target) or target not in self.names:
                    raise self._source.unreadable(
                        f"layer {name[:60]!r} names {named[:80]!r}, which is not in the archive",
                        "pack it with usdzip, all layers in one",
                    )
            if clips:
                raise self._source.refused("animated", "it holds value clips", "export a still mesh")


def _central_headers(source: MeshSource) -> int:
    """Return how often the signature of a member's entry in an archive's directory (APPNOTE 4.3.12) stands in the file."""
    count, rest = 0, b""
    with open_regular(source.path, partial(InputError, "unreadable")) as stream:
        while block := stream.read(_BLOCK_BYTES):
            count += (rest + block).count(_CENTRAL_HEADER)
            rest = block[1 - len(_CENTRAL_HEADER) :]
    return count


def package_path(path: Path, member: str) -> str:
    """Return how USD names a member of a package."""
    return f"{path}[{member}]"


def _is_inside(name: str) -> bool:
    # a backquote starts an expression, brackets a nested package, a colon a scheme or a drive
    if not name or name.startswith(("/", "\\", "~")) or re.search(r"[:`\[\]\0]", name):
        return False
    return ".." not in name.replace("\\", "/").split("/") and posixpath.normpath(name) not in ("", ".")


def _has_clips(layer: Sdf.Layer) -> bool:
    found: list[bool] = []

    def look(path: Sdf.Path) -> None:
        if path.IsPrimPath() and layer.GetPrimAtPath(path) is not None and layer.GetPrimAtPath(path).HasInfo("clips"):
            found.append(True)

    layer.Traverse(Sdf.Path.absoluteRootPath, look)
    return bool(found)


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
            self._materials[key] = self._build(material) if material else pbr_material(base_color=DEFAULT_COLOR)
        return self._materials[key]

    def _build(self, material: UsdShade.Material) -> PBRMaterial:
        name = material.GetPrim().GetName()
        shader, _, _ = material.ComputeSurfaceSource()
        if not shader or shader.GetIdAttr().Get() != "UsdPreviewSurface":
            self._source.find(f"material {name!r} is no UsdPreviewSurface; shown grey")
            return pbr_material(name, base_color=DEFAULT_COLOR)
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
            image = self._texture(producer)
            if image is not None and channel != "rgb":
                bands = image.split()
                return default, bands["rgba".index(output)] if output in "rgba" and "rgba".index(output) < len(
                    bands
                ) else bands[0]
            return (color_of_lost_texture(default) if image is None and channel == "rgb" else default), image
        value = attributes[0].Get() if attributes else socket.Get()
        return (default if value is None else value), None

    def _texture(self, reader: UsdShade.Shader) -> Image.Image | None:
        named = texture_of(reader)
        if named is None:
            return None
        # the path counts from the layer that wrote it; in a package that is the member's own folder
        layer, path = named[0].identifier, named[1]
        inner = layer[layer.rfind("[") + 1 : -1] if layer.endswith("]") else (self._archive.root or "")
        name = path if path.startswith(("/", "\\")) else posixpath.join(posixpath.dirname(inner), path)
        if name not in self._images:
            data = self._archive.read(name, "texture")
            self._images[name] = None if data is None else decode_texture(data, path, self._source)
        return self._images[name]


def texture_of(reader: UsdShade.Shader) -> tuple[Sdf.Layer, str] | None:
    """Return the file that a texture reader names, and the layer that names it; None where it names none."""
    socket = reader.GetInput("file")
    attributes = socket.GetValueProducingAttributes() if socket else []
    asset = attributes[0].Get() if attributes else None
    if asset is None or not asset.path:
        return None
    return attributes[0].GetPropertyStack(Usd.TimeCode.Default())[0].layer, asset.path


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
