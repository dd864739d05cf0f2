"""Read a photo: any common format to upright 8-bit sRGB, or one line that says why not."""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageCms, ImageOps

from manitwin.errors import InputError, choose_from
from manitwin.formats.sniff import HEIC_NOT_READ, sniff

MAX_PIXELS = 250_000_000
MIN_SIDE_PX = 32
_WIDE_GREY = ("I;16", "I;16B", "I;16L", "I;16N", "I")
_MULTI_PICTURE = ("MPO",)  # a phone's JPEG with depth map or preview behind the photo: one photo, no animation


@dataclass(frozen=True)
class Photo:
    """``pixels (H, W, 3 or 4) uint8`` upright sRGB (RGBA where the file has transparency), and what was done to get it."""

    pixels: np.ndarray
    findings: tuple[str, ...]


def read_image(path: Path, *, frame: int | None = None, max_side_px: int | None = None) -> Photo:
    """Read an image file.

    EXIF orientation, CMYK, embedded colour profiles, palettes and 16-bit grey are converted. ``frame`` chooses a picture of an
    animation (counted from 0). ``max_side_px`` scales a larger photo down.

    Raises InputError: ``unreadable``, ``empty``, ``wrong_type``, ``too_small``, ``animated``; each names the file, the
    cause and the remedy.
    """
    found = sniff(path)
    if found.kind != "image":
        raise InputError(
            "wrong_type", f"{path.name}: is a mesh ({found.format}), not an image; give it as a mesh input"
        )
    if found.format == "heif":
        raise InputError("wrong_type", f"{path.name}: {HEIC_NOT_READ}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the limit is checked below
        image = _open(path)
        findings: list[str] = []
        with image:
            _check_size(path, image)
            _choose_frame(path, image, frame, findings)
            if max_side_px is not None and image.format == "JPEG":
                image.draft(None, (max_side_px, max_side_px))  # decodes at a half, a quarter, an eighth: never smaller
            _decode(path, image)
            upright = ImageOps.exif_transpose(image)
            if image.getexif().get(0x0112, 1) not in (0, 1):
                findings.append("turned upright as its EXIF orientation says")
            rgb = _to_srgb(path, upright, image.info.get("icc_profile"), findings)
    if max_side_px is not None and max(rgb.size) > max_side_px:
        scale = max_side_px / max(rgb.size)
        rgb = _scaled(rgb, (max(1, round(rgb.width * scale)), max(1, round(rgb.height * scale))))
        findings.append(f"scaled down to {rgb.width} x {rgb.height}")
    return Photo(np.asarray(rgb), tuple(findings))


def png_of(pixels: np.ndarray) -> bytes:
    """Return a picture ``(H, W, 3 or 4) uint8`` as a PNG; equal pictures give equal bytes."""
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()


def check_header(path: Path, *, frame: int | None = None) -> None:
    """Raise InputError for what an image's header tells already, as ``read_image`` would: its size, and an animation."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        with _open(path) as image:
            _check_size(path, image)
            _choose_frame(path, image, frame, [])


def _open(path: Path) -> Image.Image:
    try:
        return Image.open(path)
    except Image.DecompressionBombError as error:  # raised at twice Pillow's own limit, before this module can look
        raise _too_large(path) from error
    except Exception as error:  # a decoder may raise anything on damaged bytes; the message names the cause
        raise _damaged(path, error) from error


def _decode(path: Path, image: Image.Image) -> None:
    try:
        image.load()
    except Image.DecompressionBombError as error:
        raise _too_large(path) from error
    except Exception as error:  # as above
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> InputError:
    cause = str(error).splitlines()[0] if str(error) else type(error).__name__
    if isinstance(error, Image.UnidentifiedImageError):
        cause = "no decoder for it, or its header is damaged"
    detail = f"{path.name}: truncated or corrupt image ({cause}); export or download it again, as PNG or JPEG"
    return InputError("unreadable", detail)


def _too_large(path: Path) -> InputError:
    return InputError("unreadable", f"{path.name}: more than {MAX_PIXELS // 1_000_000} megapixels; scale it down first")


def _check_size(path: Path, image: Image.Image) -> None:
    if image.width * image.height > MAX_PIXELS:
        raise _too_large(path)
    if min(image.size) < MIN_SIDE_PX:
        raise InputError(
            "too_small",
            f"{path.name}: {image.width} x {image.height} pixels, the shorter side must have at least {MIN_SIDE_PX};"
            " give a larger photo",
        )


def _choose_frame(path: Path, image: Image.Image, frame: int | None, findings: list[str]) -> None:
    count = 1 if image.format in _MULTI_PICTURE else getattr(image, "n_frames", 1)
    if count == 1:
        return
    if frame is None:
        raise InputError(
            "animated",
            f"{path.name}: an animation or a file of {count} pictures; save one of them as PNG, or set frame in the"
            f" configuration to 0..{count - 1}",
        )
    if not 0 <= frame < count:
        raise InputError("animated", f"{path.name}: {choose_from('frame', str(frame), map(str, range(count)))}")
    try:
        image.seek(frame)
    except Exception as error:  # as in _open
        raise _damaged(path, error) from error
    findings.append(f"used frame {frame} of {count}")


def _to_srgb(path: Path, image: Image.Image, profile: bytes | None, findings: list[str]) -> Image.Image:
    if image.mode in _WIDE_GREY:
        values = np.asarray(image).astype(np.int64)
        if values.min() < 0 or values.max() > 65535:
            raise InputError("unreadable", f"{path.name}: more than 16 bits a pixel; save it as 8-bit PNG")
        findings.append("scaled 16-bit grey to 8 bit")
        return Image.fromarray(((values + 128) // 257).astype(np.uint8)).convert("RGB")
    if image.mode == "F":
        raise InputError("unreadable", f"{path.name}: floating-point pixels have no known white; save it as 8-bit PNG")
    transparent = image.mode in ("RGBA", "LA", "La", "RGBa", "PA") or "transparency" in image.info
    if profile and image.mode in ("RGB", "CMYK", "L", "RGBA"):
        image = _apply_profile(image, profile, findings)
    if image.mode == "CMYK":
        findings.append("converted from CMYK")
    return image.convert("RGBA" if transparent else "RGB")


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
    """Scale with premultiplied alpha: colours hidden under full transparency do not bleed into the visible ones."""
    if image.mode != "RGBA":
        return image.resize(size, Image.Resampling.LANCZOS)
    return image.convert("RGBa").resize(size, Image.Resampling.BOX, reducing_gap=3.0).convert("RGBA")
