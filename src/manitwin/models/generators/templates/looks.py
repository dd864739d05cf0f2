"""Colours and materials by the words that people use, as PBR materials and densities.

Colour words follow ISCC-NBS (Kelly and Judd 1955, level 2); the shades are typical of dyed and painted goods. Roughness and
metalness are typical values of physically based material libraries. Densities are those of ``prior_tables/materials.toml``,
a solid block of the material.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

COLORS: dict[str, str] = {
    "white": "f2f2ee", "black": "1c1c1e", "grey": "8a8c8e", "red": "c4262b", "orange": "e87a1e", "yellow": "f0c828",
    "green": "2f8f45", "blue": "2457a8", "purple": "6b3fa0", "pink": "ea8fae", "brown": "744a2c", "beige": "dcc9a4",
    "cream": "f2e8cf", "turquoise": "3fbfba", "teal": "177a7c", "navy": "1b2f5e", "gold": "c39a33", "silver": "c4c6c8",
    "copper": "b4693f", "bronze": "8c6a3a", "olive": "6f7032", "lime": "a6c93a", "magenta": "b8287f", "maroon": "6e1a20",
    "violet": "7a4fb0", "lavender": "bda9db", "mint": "a9dcc0", "coral": "ee7a66", "ivory": "f4efdf", "tan": "c4a277",
    "khaki": "a89a6c", "charcoal": "3a3c3f", "burgundy": "641c2a", "cyan": "32b4cf", "peach": "f5c0a0",
    "terracotta": "b9623f", "clear": "dfe9e8",
}  # fmt: skip
"""sRGB by word."""
SAME_COLOR = {"gray": "grey", "silvery": "silver", "golden": "gold", "rose": "pink", "crimson": "red", "scarlet": "red"}
SAME_COLOR |= {"amber": "orange", "aqua": "cyan", "indigo": "navy", "off-white": "ivory", "lilac": "lavender"}
SHADES = {"light": 0.45, "pale": 0.6, "pastel": 0.5, "dark": -0.45, "deep": -0.3, "bright": 0.0, "matte": 0.0}
"""How far towards white (positive) or black (negative) a word before a colour moves it."""


@dataclass(frozen=True)
class Look:
    """The appearance and matter of a part: ``rgb`` sRGB in 0..1, PBR factors, a surface of the priors' materials, density.

    ``wall`` is how thick such a wall is made, over one of ceramic: sheet metal is thin."""

    material: str
    surface: str
    rgb: tuple[float, float, float]
    roughness: float
    metallic: float
    density_kg_m3: float
    wall: float = 1.0

    def colored(self, rgb: tuple[float, float, float]) -> Look:
        """Return the same matter in another colour."""
        return replace(self, rgb=rgb)


def _rgb(text: str) -> tuple[float, float, float]:
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (0, 2, 4))
    return red, green, blue


_WALLS = {
    "ceramic": 1.0,
    "glass": 0.8,
    "plastic": 0.6,
    "rubber": 0.8,
    "steel": 0.25,
    "aluminium": 0.4,
    "wood": 1.4,
    "paper": 0.25,
}


def _look(name: str, surface: str, color: str, roughness: float, density: float, metallic: float = 0.0) -> Look:
    return Look(
        name, surface, _rgb(color), roughness, metallic, density, 1.0 if "cast" in name else _WALLS.get(surface, 1.0)
    )


MATERIALS: dict[str, Look] = {
    look.material: look
    for look in (
        _look("ceramic", "ceramic", "f2f0ea", 0.25, 2300),
        _look("porcelain", "ceramic", "f6f5f2", 0.15, 2400),
        _look("stoneware", "ceramic", "a89c8a", 0.45, 2250),
        _look("earthenware", "ceramic", "b9623f", 0.8, 2000),
        _look("glass", "glass", "d4e4e2", 0.05, 2500),
        _look("plastic", "plastic", "d8d8d6", 0.4, 1050),
        _look("melamine", "plastic", "ece7da", 0.3, 1500),
        _look("silicone", "rubber", "8f9598", 0.7, 1150),
        _look("rubber", "rubber", "232325", 0.85, 1150),
        _look("foam", "foam", "e7c94a", 0.95, 60),
        _look("stainless steel", "steel", "b9bbbd", 0.25, 7850, 1.0),
        _look("steel", "steel", "a6a8aa", 0.35, 7850, 1.0),
        _look("chrome", "steel", "cfd1d3", 0.08, 7850, 1.0),
        _look("iron", "steel", "4a4a4c", 0.6, 7300, 1.0),
        _look("cast iron", "steel", "2c2c2e", 0.75, 7200, 0.6),
        _look("enamel", "steel", "e9ecec", 0.2, 7600),
        _look("aluminium", "aluminium", "c2c4c6", 0.35, 2700, 1.0),
        _look("brass", "steel", "c09a4a", 0.3, 8500, 1.0),
        _look("copper", "steel", "b4693f", 0.3, 8900, 1.0),
        _look("wood", "wood", "b08455", 0.65, 650),
        _look("bamboo", "wood", "d2b072", 0.6, 700),
        _look("cork", "foam", "b78c5c", 0.9, 200),
        _look("cardboard", "cardboard", "b08d5f", 0.85, 690),
        _look("paper", "paper", "f3f1ea", 0.9, 800),
        _look("leather", "leather", "6b4226", 0.6, 900),
        _look("fabric", "textile", "7f8fa3", 0.95, 400),
        _look("bristle", "textile", "e6dfc8", 0.9, 300),
        _look("wax", "wax", "f1ead6", 0.5, 900),
        _look("stone", "stone", "85837e", 0.8, 2600),
        _look("soap", "wax", "e7d9c3", 0.45, 1050),
        _look("electronics", "plastic", "26272a", 0.35, 1800),
    )
}
"""Looks by the word for the material, in its own usual colour."""
SAME_MATERIAL = {
    "wooden": "wood", "metal": "stainless steel", "metallic": "stainless steel", "stainless": "stainless steel",
    "inox": "stainless steel", "plastics": "plastic", "aluminum": "aluminium", "tin": "steel", "clay": "earthenware",
    "pottery": "stoneware", "china": "porcelain", "woolen": "fabric", "cloth": "fabric", "textile": "fabric",
    "marble": "stone", "granite": "stone", "carton": "cardboard", "rubbery": "rubber", "glassy": "glass",
}  # fmt: skip


def color_of(word: str) -> tuple[float, float, float] | None:
    """Return the sRGB colour that a word names, None where it names none."""
    name = SAME_COLOR.get(word, word)
    return _rgb(COLORS[name]) if name in COLORS else None


def shaded(rgb: tuple[float, float, float], shade: str) -> tuple[float, float, float]:
    """Return a colour as light or dark as a word before it says."""
    amount = SHADES[shade]
    towards = np.ones(3) if amount > 0 else np.zeros(3)
    red, green, blue = (1 - abs(amount)) * np.array(rgb) + abs(amount) * towards
    return float(red), float(green), float(blue)


def material_of(word: str) -> Look | None:
    """Return the look of the material that a word or two name, None where they name none."""
    return MATERIALS.get(SAME_MATERIAL.get(word, word))


def look_of(words: str) -> Look:
    """Return the look that 'colour material' or 'material' describes; raises ValueError for any other words."""
    parts = words.split()
    for cut in range(len(parts)):
        look = material_of(" ".join(parts[cut:]))
        if look is not None and cut == 0:
            return look
        rgb = color_of(parts[cut - 1]) if look is not None else None
        if look is not None and rgb is not None:
            return look.colored(shaded(rgb, parts[0]) if cut == 2 else rgb)
    raise ValueError(f"no look {words!r}")
