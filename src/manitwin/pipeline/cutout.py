"""Doubtful cut-outs of photos: stored for review, and used if a person confirms them."""

from __future__ import annotations

import base64
import hashlib
import io
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from PIL import Image

from manitwin.errors import Rejected, UsageError
from manitwin.models.matting.matte import DoubtfulMatte, Matte

CUTOUT = "cutout.webp"
"""File in the folder of a rejected photo: the doubtful cut-out, with transparent background."""
CONFIRMED = "cutout"
"""Key of the photo stage's amendment ``{sha256, alpha_png, source}``: the digest of the reviewed image, its alpha channel as a
base64-encoded PNG file (missing in files of earlier versions), and the reviewer.
"""
SHOWN_PX = 1024
QUALITY = 85


def encode_preview(rgba: np.ndarray) -> bytes:
    """Return ``rgba (H, W, 4) uint8`` as a WebP file, at most ``SHOWN_PX`` large, for review."""
    encoded = io.BytesIO()
    picture = Image.fromarray(reduced(rgba, SHOWN_PX))
    picture.save(encoded, "WEBP", quality=QUALITY, method=4, exact=True)  # exact: keeps colours under transparency
    return encoded.getvalue()


def reduced(rgba: np.ndarray, side_px: int) -> np.ndarray:
    """Return ``rgba (H, W, 4) uint8`` at most ``side_px`` large; transparent pixels keep their colours."""
    scale = side_px / max(rgba.shape[:2])
    return cv2.resize(rgba, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else rgba


def confirmation(picture: bytes, source: str) -> dict[str, str]:
    """Return the amendment for a cut-out that the reviewer ``source`` has confirmed on the image ``picture``.

    Raises UsageError for an unreadable image.
    """
    try:
        with Image.open(io.BytesIO(picture), formats=("WEBP",)) as shown:
            alpha = shown.convert("RGBA").getchannel("A")
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise UsageError(f"{CUTOUT}: not a readable picture; run manitwin check --digests") from error
    encoded = io.BytesIO()
    alpha.save(encoded, "PNG", optimize=True)
    return {
        "sha256": hashlib.sha256(picture).hexdigest(),
        "alpha_png": base64.b64encode(encoded.getvalue()).decode("ascii"),
        "source": source,
    }


def _as_confirmed(rgba: np.ndarray, said: Mapping[str, Any]) -> np.ndarray | None:
    """Return a photo ``(H, W, 4) uint8`` with the confirmed alpha channel; None if it is missing or of another size."""
    try:
        data = base64.b64decode(said["alpha_png"], validate=True)
        with Image.open(io.BytesIO(data), formats=("PNG",)) as picture:
            if picture.size != reduced(rgba, SHOWN_PX).shape[1::-1]:  # checked before decompression
                return None
            alpha = picture.convert("L").resize(rgba.shape[1::-1], Image.Resampling.BILINEAR)
    except (KeyError, TypeError, ValueError, OSError, SyntaxError, Image.DecompressionBombError):
        return None
    return np.dstack([rgba[..., :3], np.asarray(alpha)])


def confirmed_or_rejected(doubted: DoubtfulMatte, name: str, amendment: Mapping[str, Any]) -> Matte:
    """Return a doubtful cut-out that a person has confirmed. Raises Rejected, with its image, for any other.

    ``amendment`` is that of the photo stage. If the photo would now be cut out differently (by another version or other
    settings), the confirmed alpha channel is used. If that is missing or belongs to another part of the photo, the rejection
    asks for a new review.
    """
    picture, said = encode_preview(doubted.matte.rgba), amendment.get(CONFIRMED)
    if said is None:
        raise Rejected(doubted.reason, doubted.detail, doubted.stage, {CUTOUT: picture})
    if hashlib.sha256(picture).hexdigest() != said["sha256"]:
        rgba = _as_confirmed(doubted.matte.rgba, said)
        if rgba is None:
            detail = f"{name}: the cut-out differs from the one that {said['source']} confirmed; check it again"
            raise Rejected(doubted.reason, detail, doubted.stage, {CUTOUT: picture})
        return replace(doubted.matte, rgba=rgba, findings=(f"cut out as {said['source']} confirmed it",))
    findings = (f"doubtful by itself ({doubted.matte.confidence:.2f}); {said['source']} confirmed the cut-out",)
    return replace(doubted.matte, findings=findings + doubted.matte.findings)
