"""The cut-out of a photo that is not believed: kept to be looked at, and taken where a person says that it is right."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from PIL import Image

from manitwin.errors import Rejected
from manitwin.models.matting.matte import DoubtedCutOut, Matte

CUTOUT = "cutout.webp"
"""In the folder of a rejected photo: what would have been cut out, transparent around it."""
CONFIRMED = "cutout"
"""Key of the photo stage's amendment: ``{sha256, source}``, the digest of the picture that was looked at and who did so."""
SHOWN_PX = 1024
QUALITY = 85


def shown_cutout(rgba: np.ndarray) -> bytes:
    """Return ``rgba (H, W, 4) uint8`` as a WebP file, at most ``SHOWN_PX`` large, for a person to judge."""
    encoded = io.BytesIO()
    picture = Image.fromarray(reduced(rgba, SHOWN_PX))
    picture.save(encoded, "WEBP", quality=QUALITY, method=4, exact=True)  # what is cut away is judged, too
    return encoded.getvalue()


def reduced(rgba: np.ndarray, side_px: int) -> np.ndarray:
    """Return ``rgba (H, W, 4) uint8`` at most ``side_px`` large; transparent pixels keep their colours."""
    scale = side_px / max(rgba.shape[:2])
    return cv2.resize(rgba, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else rgba


def confirmed_or_rejected(doubted: DoubtedCutOut, name: str, amendment: Mapping[str, Any]) -> Matte:
    """Return a doubted cut-out that a person has looked at and confirmed; raises Rejected of any other, with its picture.

    ``amendment`` is the photo stage's. Who confirmed another picture than would be shown now is told to look again.
    """
    picture, said = shown_cutout(doubted.matte.rgba), amendment.get(CONFIRMED)
    if said is None:
        raise Rejected(doubted.reason, doubted.detail, doubted.stage, {CUTOUT: picture})
    if hashlib.sha256(picture).hexdigest() != said["sha256"]:
        detail = f"{name}: is cut out otherwise than as {said['source']} confirmed it; look at it again"
        raise Rejected(doubted.reason, detail, doubted.stage, {CUTOUT: picture})
    findings = (f"doubtful by itself ({doubted.matte.confidence:.2f}); {said['source']} confirmed the cut-out",)
    return replace(doubted.matte, findings=findings + doubted.matte.findings)
