"""Textures in KTX2 files, as glTF's ``KHR_texture_basisu`` has them: decoded by Basis Universal's transcoder where it is there.

Sources: KTX File Format 2.0, Khronos Group 2021, section 3 (the header); glTF extension KHR_texture_basisu (supercompressed
colours, first row on top). ``pip install 'manitwin[ktx]'`` installs the transcoder.
"""

from __future__ import annotations

import struct
from importlib.util import find_spec

from PIL import Image

from manitwin.formats.isolated import Limits, ProcessCrashed, run_isolated
from manitwin.formats.meshes.source import Buffer, MeshSource

KTX2_MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
INSTALL = "pip install 'manitwin[ktx]'"
_SIZE_AT = 20
_LIMITS = Limits(seconds=60.0)
_OPAQUE = 255


def is_ktx2(data: Buffer) -> bool:
    """Whether a texture's bytes begin as a KTX2 file does."""
    return bytes(data[: len(KTX2_MAGIC)]) == KTX2_MAGIC


def ktx2_image(data: Buffer, name: str, source: MeshSource) -> Image.Image | None:
    """Decode a KTX2 texture to mode RGB or RGBA, or return None with a finding where it cannot be read or is too large.

    Raises InputError ``too_large`` where all textures together have too many pixels.
    """
    size = _size_of(data)
    if size is None:
        source.find(f"texture {name!r} is a broken KTX2 file, and was left out")
        return None
    width, height = size
    if width * height > source.limits.max_texture_pixels:
        source.find(f"texture {name!r} of {width} x {height} pixels is over the limit and was left out")
        return None
    source.count_texture(width * height)
    if not source.limits.decode_textures:
        return Image.new("RGB", (width, height))
    if find_spec("opengl_basisu") is None:
        source.find(f"texture {name!r} is KTX2, and what reads that is not installed ({INSTALL}); it was left out")
        return None
    try:
        mode, pixels = run_isolated(f"{__name__}:pixels_of", bytes(data), limits=_LIMITS)
    except (ProcessCrashed, ValueError, MemoryError) as error:
        cause = str(error) if type(error) is ValueError else "its data is broken"
        source.find(f"texture {name!r} is a KTX2 file that cannot be decoded ({cause}), and was left out")
        return None
    return Image.frombytes(mode, size, pixels)


def pixels_of(data: bytes) -> tuple[str, bytes]:
    """Return mode ``RGB`` or ``RGBA`` and the pixels of a KTX2 file's largest image, in rows from the top.

    To be run in a process of its own. Raises ValueError for what the transcoder cannot read.
    """
    import numpy as np
    import opengl_basisu

    try:
        texture = opengl_basisu.open(data)
        pixels = np.asarray(texture.transcode(opengl_basisu.Target.RGBA8).data)
    except opengl_basisu.UnsupportedError:  # whose words name classes of the library
        raise ValueError("it is not compressed as KHR_texture_basisu has it") from None
    except opengl_basisu.BasisuError:
        raise ValueError("its data is broken") from None
    if (texture.width, texture.height) != _size_of(data):
        raise ValueError("its data is broken")
    if (pixels[..., 3] == _OPAQUE).all():
        return "RGB", np.ascontiguousarray(pixels[..., :3]).tobytes()
    return "RGBA", pixels.tobytes()


def _size_of(data: Buffer) -> tuple[int, int] | None:
    """Return the width and height in pixels that the header says; None where there is no header, or no pixel."""
    if len(data) < _SIZE_AT + 8:
        return None
    width, height = struct.unpack_from("<II", data, _SIZE_AT)
    return (width, height) if width > 0 and height > 0 else None
