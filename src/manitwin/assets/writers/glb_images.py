"""The images inside a twin's visual.glb as they were encoded, so that no export encodes a photograph twice."""

from __future__ import annotations

import hashlib
import io
import json
import struct

from PIL import Image

from manitwin.formats.meshes.textures import TEXTURE_FORMATS

_SUFFIXES = {b"\x89PNG\r\n\x1a\n": "png", b"\xff\xd8\xff": "jpg"}


class GlbImages:
    """Encoded images by what they show."""

    def __init__(self, glb: bytes):
        """Read a GLB that ``files.glb.write_glb`` has made."""
        self._encoded: dict[str, bytes] = {}
        (length,) = struct.unpack_from("<I", glb, 12)
        document = json.loads(glb[20 : 20 + length])
        binary = glb[28 + length :]
        for image in document.get("images", []):
            view = document["bufferViews"][image["bufferView"]]
            data = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
            decoded = Image.open(io.BytesIO(data), formats=TEXTURE_FORMATS)
            self._encoded[self.digest(decoded.convert("RGBA" if "A" in decoded.mode else "RGB"))] = data

    def encoded(self, image: Image.Image) -> tuple[bytes, str]:
        """Return an image's file and its suffix: the one in the GLB, or a PNG where it is from elsewhere."""
        data = self._encoded.get(self.digest(image))
        if data is None:
            stream = io.BytesIO()
            image.save(stream, "PNG", compress_level=6)
            data = stream.getvalue()
        return data, next(suffix for magic, suffix in _SUFFIXES.items() if data.startswith(magic))

    @staticmethod
    def digest(image: Image.Image) -> str:
        """Say what an image shows: its mode, size and pixels."""
        return f"{image.mode}:{image.size}:{hashlib.sha256(image.tobytes()).hexdigest()}"
