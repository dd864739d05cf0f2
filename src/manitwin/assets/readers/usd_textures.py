"""UsdPreviewSurface materials of a composed stage, their textures looked up from the layer that names them."""

from __future__ import annotations

from PIL import Image
from pxr import Usd, UsdShade

from manitwin.assets.readers.usd_layers import LayerFiles
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import decode_texture
from manitwin.formats.meshes.usdz_materials import PreviewSurfaces


class LayeredSurfaces(PreviewSurfaces):
    """Materials whose textures lie beside the layers of a stage, or in their packages."""

    def __init__(self, layers: LayerFiles, source: MeshSource):
        self._layers, self._source = layers, source
        self._materials = {}
        self._images: dict[str, Image.Image | None] = {}

    def _texture(self, reader: UsdShade.Shader, stage: Usd.Stage) -> Image.Image | None:
        socket = reader.GetInput("file")
        attributes = socket.GetValueProducingAttributes() if socket else []
        asset = attributes[0].Get() if attributes else None
        if asset is None or not asset.path:
            return None
        layer = attributes[0].GetPropertyStack(Usd.TimeCode.Default())[0].layer
        key = f"{layer.identifier}:{asset.path}"
        if key not in self._images:
            data = self._layers.texture(layer, asset.path)
            self._images[key] = None if data is None else decode_texture(data, asset.path, self._source)
        return self._images[key]
