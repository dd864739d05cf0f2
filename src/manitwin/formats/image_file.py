"""Reading of photos: common formats to upright 8-bit sRGB, or an error with cause and remedy."""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image, ImageCms, ImageFile, ImageOps, TiffImagePlugin

from manitwin.errors import InputError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.focal_length import focal_length_35mm
from manitwin.formats.image_frames import MAX_PICTURES, count_pictures
from manitwin.formats.printable import printable_line
from manitwin.formats.sniff import HEIC_NOT_READ, image_format, sniff

MAX_PIXELS = 178_000_000  # slightly below Pillow's limit for decompression bombs
MAX_BYTES = 1 << 30
MAX_TEXT_PIXELS = 12_000_000
"""Limit for PPM, PGM or PBM in text form, which is decoded at less than a million pixels per second."""
MIN_SIDE_PX = 32
_MIN_SCALED_PX = 8  # a narrower strip shows no object
_ORIENTATION = 0x0112  # EXIF
_ON_ITS_SIDE = (5, 6, 7, 8)  # orientations that swap width and height
_PNM_TEXT = "ppm_plain"  # Pillow's decoder of text PNM
_CAUSE_CHARACTERS = 200
_MEGAPIXELS = f"more than {MAX_PIXELS // 1_000_000} megapixels"
_WIDE_GREY = ("I;16", "I;16B", "I;16L", "I;16N", "I")
_MULTI_PICTURE = ("MPO",)  # a phone's JPEG with a depth map or preview after the photo: one photo, no animation
_SUBFILE_TYPE, _REDUCED = 254, 1  # TIFF 6.0, NewSubfileType: a smaller version of another picture in the file
_MOST_LEVELS = 16  # of a pyramid, each half as large as the previous one


@dataclass(frozen=True)
class Photo:
    """A decoded photo: ``pixels (H, W, 3 or 4) uint8``, upright sRGB (RGBA with transparency).

    ``findings`` list the conversions. ``focal_mm`` is the 35 mm equivalent focal length if EXIF states a plausible one.
    """

    pixels: np.ndarray
    findings: tuple[str, ...]
    focal_mm: float | None = None


def read_image(path: Path, *, frame: int | None = None, max_side_px: int | None = None) -> Photo:
    """Read an image file.

    EXIF orientation, CMYK, embedded colour profiles, palettes and 16-bit grey are converted. ``frame`` selects a picture of an
    animation (from 0). ``max_side_px`` scales a larger photo down.

    Raises InputError: ``unreadable``, ``too_large``, ``empty``, ``wrong_type``, ``too_small``, ``animated``; each names the
    file, the cause and the remedy.
    """
    _require_image(path)
    try:
        return _read(path, frame, max_side_px)
    except MemoryError as error:
        raise _refused(path, error) from error


def _require_image(path: Path) -> None:
    found = sniff(path)
    if found.kind != "image":
        raise InputError(
            "wrong_type", f"{_name(path)}: is a mesh ({found.format}), not an image; give it as a mesh input"
        )
    if found.format == "heif":
        raise InputError("wrong_type", f"{_name(path)}: {HEIC_NOT_READ}")


def _read(path: Path, frame: int | None, max_side_px: int | None) -> Photo:
    findings: list[str] = []
    with _opened(path) as image:
        _check_size(path, image)
        _choose_frame(path, image, frame, findings)
        size = image.size  # a draft is smaller
        if max_side_px is not None and image.format == "JPEG":
            # decodes at a half, a quarter or an eighth, never below the requested size
            image.draft(None, (max_side_px, max_side_px))
        _decode(path, image)
        turned = _orientation(image, findings) not in (0, 1)
        focal_mm = focal_length_35mm(image, size, findings)
        profile = image.info.get("icc_profile")
        # copies hundreds of megapixels only if a rotation is needed
        upright = _upright(image, findings) if turned else image
        if upright is not image:
            findings.append("turned upright as its EXIF orientation says")
        try:
            rgb = _to_srgb(path, upright, profile, findings)
        except ValueError as error:  # pixel values beyond the palette
            raise _refused(path, error) from error
    if max_side_px is not None and max(rgb.size) > max_side_px:
        scale = max_side_px / max(rgb.size)
        if round(min(rgb.size) * scale) < _MIN_SCALED_PX:
            raise InputError(
                "too_small",
                f"{_name(path)}: {rgb.width} x {rgb.height} pixels leave {round(min(rgb.size) * scale)} on its shorter side"
                f" where the longer has {max_side_px}; crop it to the object",
            )
        rgb = _scaled(rgb, (max(1, round(rgb.width * scale)), max(1, round(rgb.height * scale))))
        findings.append(f"scaled down to {rgb.width} x {rgb.height}")
    return Photo(np.asarray(rgb), tuple(findings), focal_mm)


def png_of(pixels: np.ndarray) -> bytes:
    """Encode a picture ``(H, W, 3 or 4) uint8`` as PNG, deterministically."""
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()


def check_header(path: Path, *, frame: int | None = None) -> None:
    """Raise InputError for defects that the header of an image shows, like ``read_image``: kind, size, animation."""
    _require_image(path)
    with _opened(path) as image:
        _check_size(path, image)
        _choose_frame(path, image, frame, [])


def full_size(path: Path) -> tuple[int, int, int]:
    """Return width and height of a photo, upright and unscaled, and its EXIF orientation (1: none).

    Raises InputError like ``check_header``.
    """
    _require_image(path)
    with _opened(path) as image:
        orientation = _orientation(image, [])
        number = orientation if isinstance(orientation, int) and 1 <= orientation <= 8 else 1
        width, height = image.size
        return (height, width, number) if number in _ON_ITS_SIDE else (width, height, number)


@contextmanager
def _opened(path: Path) -> Iterator[Image.Image]:
    """Open an image, reading only its header; warnings of decoders are suppressed."""
    unreadable = partial(InputError, "unreadable")
    with open_regular(path, unreadable) as stream, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # this module checks the limits itself
        if os.fstat(stream.fileno()).st_size > MAX_BYTES:
            raise _too_large(path, f"{os.fstat(stream.fileno()).st_size} bytes exceed the limit of {MAX_BYTES}")
        if (count_pictures(stream, image_format(stream.read(64)) or "") or 0) > MAX_PICTURES:
            raise _too_large(path, f"more than {MAX_PICTURES} pictures in one file")
        stream.seek(0)
        try:
            image = Image.open(stream)
        except Exception as error:  # a decoder may raise anything on damaged bytes; the message names the cause
            raise _refused(path, error) from error
        with image:
            yield image


def _decode(path: Path, image: Image.Image) -> None:
    try:
        image.load()
    except Exception as error:  # as above
        raise _refused(path, error) from error


def _refused(path: Path, error: Exception) -> InputError:
    """Return the error for an image that a decoder fails on."""
    if isinstance(
        error, Image.DecompressionBombError
    ):  # raised at twice Pillow's own limit, before this module can check
        return _too_large(path, _MEGAPIXELS)
    if isinstance(error, MemoryError):
        return _too_large(path, "it needs more memory than is available")
    cause = str(error).splitlines()[0] if str(error) else type(error).__name__
    if isinstance(error, Image.UnidentifiedImageError):
        cause = "no decoder supports it, or its header is damaged"
    cause = printable_line(cause, max_characters=_CAUSE_CHARACTERS)
    detail = f"{_name(path)}: truncated or corrupt image ({cause}); export or download it again, as PNG or JPEG"
    return InputError("unreadable", detail)


def _too_large(path: Path, cause: str) -> InputError:
    return InputError("too_large", f"{_name(path)}: {cause}; scale the picture down first")


def _name(path: Path) -> str:
    return printable_line(path.name, max_characters=_CAUSE_CHARACTERS)


def _orientation(image: Image.Image, findings: list[str]) -> object:
    """Return the EXIF orientation, 1 if EXIF is unreadable, which does not affect the picture itself."""
    try:
        return image.getexif().get(_ORIENTATION, 1)
    except Exception as error:  # Pillow raises whatever its parsing of broken EXIF meets
        findings.append(f"its EXIF is broken ({type(error).__name__}) and was not read")
        return 1


def _upright(image: Image.Image, findings: list[str]) -> Image.Image:
    try:
        return ImageOps.exif_transpose(image)
    except Exception as error:  # it also rewrites the other tags, which may be broken
        findings.append(f"its EXIF is broken ({type(error).__name__}): it was not turned")
        return image


def _check_size(path: Path, image: Image.Image) -> None:
    if image.width * image.height > MAX_PIXELS:
        raise _too_large(path, _MEGAPIXELS)
    tiles = image.tile if isinstance(image, ImageFile.ImageFile) else []
    if tiles and tiles[0][0] == _PNM_TEXT and image.width * image.height > MAX_TEXT_PIXELS:
        raise InputError(
            "too_large",
            f"{_name(path)}: more than {MAX_TEXT_PIXELS // 1_000_000} megapixels in a text format; save it as PNG"
            f" or binary PPM",
        )
    if min(image.size) < MIN_SIDE_PX:
        raise InputError(
            "too_small",
            f"{_name(path)}: {image.width} x {image.height} pixels; the shorter side must have at least {MIN_SIDE_PX};"
            " give a larger photo",
        )


def _choose_frame(path: Path, image: Image.Image, frame: int | None, findings: list[str]) -> None:
    count = 1 if image.format in _MULTI_PICTURE else _pictures(path, image)
    if count == 1:
        return
    if frame is None:
        raise InputError(
            "animated",
            f"{_name(path)}: an animation or a file with {count} pictures; save one of them as PNG, or set frame in the"
            f" configuration to 0..{count - 1}",
        )
    if not 0 <= frame < count:
        raise InputError(
            "animated", f"{_name(path)}: has no frame {frame}; set frame in the configuration to 0..{count - 1}"
        )
    try:
        image.seek(frame)
    except Exception as error:  # as in _opened
        raise _refused(path, error) from error
    findings.append(f"used frame {frame} of {count}")


def _pictures(path: Path, image: Image.Image) -> int:
    """Return the number of pictures in a file; previews and pyramid levels after a TIFF's picture do not count."""
    try:
        count = int(getattr(image, "n_frames", 1))
        if isinstance(image, TiffImagePlugin.TiffImageFile) and 1 < count <= _MOST_LEVELS:
            reduced = [_is_reduced(image, frame) for frame in range(count)]
            image.seek(0)
            return 1 if not reduced[0] and all(reduced[1:]) else count
        return count
    except Exception as error:  # as in _opened
        raise _refused(path, error) from error


def _is_reduced(image: TiffImagePlugin.TiffImageFile, frame: int) -> bool:
    image.seek(frame)
    return bool(int(image.tag_v2.get(_SUBFILE_TYPE, 0)) & _REDUCED)


def _to_srgb(path: Path, image: Image.Image, profile: bytes | None, findings: list[str]) -> Image.Image:
    if image.mode in _WIDE_GREY:
        values = np.asarray(image)
        if values.min() < 0 or values.max() > 65535:
            raise InputError("unreadable", f"{_name(path)}: more than 16 bits per pixel; save it as 8-bit PNG")
        findings.append("scaled 16-bit grey to 8 bit")
        return Image.fromarray(((values.astype(np.uint32) + 128) // 257).astype(np.uint8)).convert("RGB")
    if image.mode == "F":
        raise InputError(
            "unreadable", f"{_name(path)}: the white level of floating-point pixels is unknown; save it as 8-bit PNG"
        )
    transparent = image.mode in ("RGBA", "LA", "La", "RGBa", "PA") or "transparency" in image.info
    if profile and image.mode in ("RGB", "CMYK", "L", "RGBA"):
        image = _apply_profile(image, profile, findings)
    if image.mode == "CMYK":
        findings.append("converted from CMYK")
    mode = "RGBA" if transparent else "RGB"
    return image if image.mode == mode else image.convert(mode)


def _apply_profile(image: Image.Image, profile: bytes, findings: list[str]) -> Image.Image:
    try:
        source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        name = ImageCms.getProfileDescription(source).strip()
        if name.lower().startswith("srgb"):
            return image
        alpha = image.getchannel("A") if image.mode == "RGBA" else None
        colours = image.convert("RGB") if alpha is not None else image
        converted = ImageCms.profileToProfile(colours, source, ImageCms.createProfile("sRGB"), outputMode="RGB")
    except (ImageCms.PyCMSError, OSError, ValueError) as error:
        findings.append(f"embedded colour profile not usable ({str(error).splitlines()[0]}): taken as sRGB")
        return image
    assert converted is not None
    if alpha is not None:
        converted.putalpha(alpha)
    findings.append(f"converted from colour profile {name!r}")
    return converted


def _scaled(image: Image.Image, size: tuple[int, int]) -> Image.Image:
    """Scale with premultiplied alpha, so that colours under full transparency do not bleed into visible ones."""
    if image.mode != "RGBA":
        return image.resize(size, Image.Resampling.LANCZOS)
    return image.convert("RGBa").resize(size, Image.Resampling.BOX, reducing_gap=3.0).convert("RGBA")
