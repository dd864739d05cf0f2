"""KTX2 textures of glTF's ``KHR_texture_basisu``, as a Pillow image format decoded by Basis Universal.

Sources: KTX File Format 2.0, Khronos Group 2021, section 3 (the header); glTF extension KHR_texture_basisu (supercompressed
colours, first row on top). ``pip install 'manitwin[ktx]'`` installs the transcoder.
"""

from __future__ import annotations

import struct
from importlib.util import find_spec

import numpy as np
from PIL import Image, ImageFile

from manitwin.formats.isolated import Limits, ProcessCrashed, run_isolated

KTX2 = "KTX2"
KTX2_MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
INSTALL = "pip install 'manitwin[ktx]'"
_SIZE_AT = 20
_LIMITS = Limits(seconds=60.0)
_BROKEN = "KTX2: its data is broken"
_OPAQUE = 255


class Ktx2ImageFile(ImageFile.ImageFile):
    """A KTX2 file, of which only the size is known until its pixels are loaded as RGB or RGBA."""

    format = KTX2
    format_description = "Khronos texture 2.0"

    def _open(self) -> None:
        assert self.fp is not None  # Pillow has opened it
        head = self.fp.read(_SIZE_AT + 8)
        if not head.startswith(KTX2_MAGIC) or len(head) < _SIZE_AT + 8:
            raise SyntaxError("no KTX2 file")  # Pillow's convention for a file of another format
        self._size = struct.unpack_from("<II", head, _SIZE_AT)
        self._mode = "RGBA"

    def load(self) -> Image.core.PixelAccess | None:
        """Decode the largest image in an isolated process; raises ValueError for data that the transcoder cannot read."""
        if find_spec("opengl_basisu") is None:
            raise ValueError(f"what reads KTX2 is not installed: {INSTALL}")
        assert self.fp is not None
        self.fp.seek(0)
        try:
            mode, pixels = run_isolated(f"{__name__}:pixels_of", self.fp.read(), limits=_LIMITS)
        except ProcessCrashed as error:
            raise ValueError(_BROKEN) from error
        picture = Image.frombytes(mode, self._size, pixels)
        # from here on it is that picture, like Pillow's StubImageFile
        self.__class__, self.__dict__ = Image.Image, picture.__dict__  # type: ignore[assignment]
        return self.load()


def pixels_of(data: bytes) -> tuple[str, bytes]:
    """Return mode ``RGB`` or ``RGBA`` and the pixels of a KTX2 file's largest image, in rows from the top.

    To be run in an isolated process. Raises ValueError for data that the transcoder cannot read.
    """
    import opengl_basisu

    try:
        texture = opengl_basisu.open(data)
        pixels = np.asarray(texture.transcode(opengl_basisu.Target.RGBA8).data)
    except opengl_basisu.UnsupportedError:  # its message names classes of the library
        raise ValueError("KTX2: not compressed as KHR_texture_basisu has it") from None
    except opengl_basisu.BasisuError:
        raise ValueError(_BROKEN) from None
    if (texture.width, texture.height) != struct.unpack_from("<II", data, _SIZE_AT):
        raise ValueError(_BROKEN)
    if (pixels[..., 3] == _OPAQUE).all():
        return "RGB", np.ascontiguousarray(pixels[..., :3]).tobytes()
    return "RGBA", pixels.tobytes()


def register_ktx2() -> None:
    """Register the format with Pillow by its first bytes; it is opened only if ``KTX2`` is among the requested formats."""
    Image.register_open(KTX2, Ktx2ImageFile, lambda head: head.startswith(KTX2_MAGIC))
