"""Focal length in a photo's EXIF, as 35 mm equivalent (EXIF 2.32, section 4.6.5)."""

from __future__ import annotations

import math

from PIL import Image

EXIF_IFD = 0x8769
FOCAL_LENGTH_MM, FOCAL_LENGTH_35MM = 0x920A, 0xA405
WIDTH_PX, HEIGHT_PX = 0xA002, 0xA003
PLANE_X_RESOLUTION, PLANE_UNIT = 0xA20E, 0xA210
UNIT_MM = {2: 25.4, 3: 10.0, 4: 1.0}
"""Units of the focal plane resolution, in millimetres: inch, centimetre, millimetre."""
DIAGONAL_35MM = 43.27
LEAST_MM, MOST_MM = 6.0, 1200.0
"""Range from circular fisheyes to supertelephotos; a value outside is invalid (0: unknown)."""
SAME_ASPECT = 0.03
LENS = "its EXIF states a focal length"


def focal_length_35mm(image: Image.Image, size: tuple[int, int], findings: list[str]) -> float | None:
    """Return the 35 mm equivalent in mm of an opened photo with full ``size`` (width, height); None if not stated.

    If only the focal length of the lens is stated, the sensor size follows from the focal plane resolution. Impossible values,
    and values of a photo that was cropped since, are ignored with a remark in ``findings``.
    """
    try:
        stated = image.getexif().get_ifd(EXIF_IFD)
        focal_mm = _number(stated.get(FOCAL_LENGTH_35MM)) or _from_sensor(stated, size)
        taken = [_number(stated.get(tag)) for tag in (WIDTH_PX, HEIGHT_PX)]
    except Exception as error:  # Pillow raises whatever its parsing of broken EXIF meets
        if not any("EXIF is broken" in finding for finding in findings):
            findings.append(f"its EXIF is broken ({type(error).__name__}): the focal length was not read")
        return None
    if focal_mm is None:
        return None
    if not LEAST_MM <= focal_mm <= MOST_MM:
        findings.append(f"{LENS} of {focal_mm:.4g} mm, which no lens has: not used")
        return None
    if taken[0] and taken[1] and abs(math.log(_aspect(taken[0], taken[1]) / _aspect(*size))) > SAME_ASPECT:
        findings.append(f"{LENS} of a picture of another shape: cropped since, not used")
        return None
    return round(focal_mm, 2)


def _from_sensor(stated: dict[int, object], size: tuple[int, int]) -> float | None:
    focal_mm, per_unit = _number(stated.get(FOCAL_LENGTH_MM)), _number(stated.get(PLANE_X_RESOLUTION))
    unit_mm = UNIT_MM.get(int(_number(stated.get(PLANE_UNIT)) or 0))
    if not focal_mm or not per_unit or unit_mm is None:
        return None
    taken = [_number(stated.get(tag)) or own for tag, own in zip((WIDTH_PX, HEIGHT_PX), size, strict=True)]
    sensor_mm = math.hypot(*taken) / per_unit * unit_mm
    return focal_mm * DIAGONAL_35MM / sensor_mm


def _number(value: object) -> float | None:
    """Return the number of a tag; None if it has none, or one that is not positive and finite."""
    if not hasattr(value, "__float__"):
        return None
    number = float(value)
    return number if math.isfinite(number) and number > 0 else None


def _aspect(width: float, height: float) -> float:
    return max(width, height) / min(width, height)
