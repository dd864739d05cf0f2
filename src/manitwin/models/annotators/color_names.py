"""Names of colours: the nearest of a table of everyday names, in CIELAB."""

from __future__ import annotations

import numpy as np

# (name, sRGB hex). Several shades share a name. Names and regions follow the ISCC-NBS centroid colours (Kelly and Judd
# 1955, level 2) and the basic colour terms of Berlin and Kay 1969; the shades are chosen by eye within those regions.
_SHADES: tuple[tuple[str, str], ...] = (
    ("blue", "0a18f0"), ("blue", "1e3cbe"), ("dark blue", "0a0a8c"), ("dark red", "8c0808"),
    ("black", "0a0a0a"), ("black", "1c1c1e"), ("dark grey", "3c3c3c"), ("dark grey", "555555"),
    ("grey", "787878"), ("grey", "929292"), ("light grey", "b0b0b0"), ("light grey", "cccccc"),
    ("white", "e6e6e6"), ("white", "fdfdfd"), ("cream", "f3ead2"), ("cream", "fff5d9"),
    ("beige", "e0cda9"), ("beige", "c9b48e"), ("tan", "b8946a"), ("tan", "c8a27a"),
    ("brown", "8b5a2b"), ("brown", "7a4a32"), ("brown", "6b4226"), ("brown", "94704c"),
    ("dark brown", "3e2a1c"), ("dark brown", "4a3426"), ("red", "d01c1f"), ("red", "b3202a"),
    ("red", "e23b30"), ("dark red", "7d1416"), ("dark red", "5c1a1b"), ("pink", "f2a7b8"),
    ("pink", "e87ba0"), ("pink", "f6cfd6"), ("orange", "f07c1c"), ("orange", "d9661f"),
    ("orange", "f79b3e"), ("dark orange", "b0521c"), ("gold", "c79a2b"), ("gold", "b58a3c"),
    ("yellow", "f5d328"), ("yellow", "e3c01c"), ("yellow", "fae36b"), ("light yellow", "fbf0a5"),
    ("olive", "77762c"), ("olive", "5d5c26"), ("yellow-green", "a8c43a"), ("yellow-green", "c9d94f"),
    ("green", "2f9440"), ("green", "4aa84e"), ("green", "5c8a4c"), ("light green", "9bd49a"),
    ("light green", "b9e3b4"), ("dark green", "14512a"), ("dark green", "2d4a30"), ("teal", "0f8080"),
    ("teal", "2a6b70"), ("turquoise", "3fc4bf"), ("light blue", "9cc9ea"), ("light blue", "bcd9ee"),
    ("blue", "1f63c0"), ("blue", "3a86d4"), ("blue", "2a4fb0"), ("blue", "5a86b5"),
    ("dark blue", "14285c"), ("dark blue", "1f3557"), ("grey-blue", "76899c"), ("purple", "6b3fa0"),
    ("purple", "8552b0"), ("dark purple", "3d2352"), ("lavender", "c0a8dc"), ("magenta", "c2278a"),
    ("magenta", "9c2a74"), ("grey-brown", "7d7064"), ("grey-green", "77826f"),
)  # fmt: skip

_WHITE_D65 = np.array([0.95047, 1.0, 1.08883])
_LINEAR_SRGB_TO_XYZ = np.array(  # IEC 61966-2-1
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def lab_from_srgb(rgb: np.ndarray) -> np.ndarray:
    """Convert sRGB ``(..., 3)`` in 0..1 to CIELAB (D65). Source: IEC 61966-2-1 and CIE 15:2004, 8.2.1."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = linear @ _LINEAR_SRGB_TO_XYZ.T / _WHITE_D65
    cube = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = cube[..., 0], cube[..., 1], cube[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def _srgb_from_hex(text: str) -> list[float]:
    return [int(text[i : i + 2], 16) / 255 for i in (0, 2, 4)]


_NAMES = [name for name, _ in _SHADES]
_LAB = lab_from_srgb(np.array([_srgb_from_hex(shade) for _, shade in _SHADES]))


def color_name(lab: np.ndarray) -> str:
    """Return the everyday name of a CIELAB colour ``(3,)``."""
    return _NAMES[int(np.linalg.norm(_LAB - lab, axis=1).argmin())]
