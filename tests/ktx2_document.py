"""KTX2 textures of even blocks of 4 x 4 pixels, and a glTF square that wears one.

Sources: KTX File Format 2.0 and Khronos Data Format 1.3 (colour model 166); UASTC LDR 4x4, mode 8, which is one colour a block.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np

from manitwin.formats.glb import pack_glb
from manitwin.formats.meshes.ktx2 import KTX2_MAGIC

BLOCK_PX = 4
EVEN_BLOCK, EVEN_BLOCK_BITS = 23, 5  # mode 8 and the bits of its prefix


def ktx2_of_blocks(colors: np.ndarray, *, supercompression: int = 0) -> bytes:
    """Return a KTX2 file of blocks of the ``colors (H, W, 4) uint8``, the first row on top."""
    rows, columns = colors.shape[:2]
    blocks = b"".join(_even_block(color) for row in colors for color in row)
    opaque = bool((colors[..., 3] == 255).all())
    descriptor = _descriptor(channel=0 if opaque else 3)
    level_at = len(KTX2_MAGIC) + 9 * 4 + 4 * 4 + 2 * 8
    descriptor_at = level_at + 3 * 8
    data_at = -(-(descriptor_at + len(descriptor)) // 16) * 16
    size = BLOCK_PX * columns, BLOCK_PX * rows
    head = KTX2_MAGIC + struct.pack("<9I", 0, 1, *size, 0, 0, 1, 1, supercompression)
    head += struct.pack("<4I2Q", descriptor_at, len(descriptor), 0, 0, 0, 0)
    head += struct.pack("<3Q", data_at, len(blocks), len(blocks)) + descriptor
    return head.ljust(data_at, b"\0") + blocks


def square_with(textures: Sequence[tuple[bytes, str]], texture: dict[str, object]) -> bytes:
    """Return the GLB of a unit square whose base colour is a ``texture`` over images, each bytes and MIME type."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    faces = np.array([0, 1, 2, 0, 2, 3], np.uint32)
    chunks = [corners.tobytes(), uv.tobytes(), faces.tobytes(), *(data for data, _ in textures)]
    views, binary = [], b""
    for chunk in chunks:
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(chunk)})
        binary += chunk + b"\0" * (-len(chunk) % 4)
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
        {"bufferView": 2, "componentType": 5125, "count": 6, "type": "SCALAR"},
    ]
    primitive = {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}
    tree = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}], "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
        "images": [{"bufferView": 3 + place, "mimeType": kind} for place, (_, kind) in enumerate(textures)],
        "textures": [texture], "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "extensionsUsed": ["KHR_texture_basisu"], "extensionsRequired": ["KHR_texture_basisu"],
    }  # fmt: skip
    return pack_glb(tree, binary)


def _even_block(color: np.ndarray) -> bytes:
    bits, at = EVEN_BLOCK, EVEN_BLOCK_BITS
    for channel in color.tolist():
        bits |= channel << at
        at += 8
    return bits.to_bytes(16, "little")


def _descriptor(channel: int) -> bytes:
    """Return the data format descriptor of UASTC in sRGB: one sample of 128 bits, of a channel (0 RGB, 3 RGBA)."""
    uastc, bt709, srgb = 166, 1, 2
    block = struct.pack("<HHHH", 0, 0, 2, 40) + bytes([uastc, bt709, srgb, 0, 3, 3, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0])
    sample = struct.pack("<HBBBBBBII", 0, 127, channel, 0, 0, 0, 0, 0, 0xFFFFFFFF)
    return struct.pack("<I", 4 + len(block) + len(sample)) + block + sample
