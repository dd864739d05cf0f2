"""Colours and materials by everyday words, as PBR materials and densities.

Colour words follow ISCC-NBS (Kelly and Judd 1955, level 2); the shades are typical of dyed and painted goods. Roughness and
metalness are typical values of physically based material libraries. Densities are those of solid material as in
``prior_tables/materials.toml``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

COLORS: dict[str, str] = {
    "white": "f2f2ee", "black": "1c1c1e", "grey": "8a8c8e", "red": "c4262b", "orange": "e87a1e", "yellow": "f0c828",
    "green": "2f8f45", "blue": "2457a8", "purple": "6b3fa0", "pink": "ea8fae", "brown": "744a2c", "beige": "dcc9a4",
    "cream": "f2e8cf", "turquoise": "3fbfba", "teal": "177a7c", "navy": "1b2f5e", "gold": "c39a33", "silver": "c4c6c8",
    "copper": "b4693f", "bronze": "8c6a3a", "olive": "6f7032", "lime": "a6c93a", "magenta": "b8287f", "maroon": "6e1a20",
    "violet": "7a4fb0", "lavender": "bda9db", "mint": "a9dcc0", "coral": "ee7a66", "ivory": "f4efdf", "tan": "c4a277",
    "khaki": "a89a6c", "charcoal": "3a3c3f", "burgundy": "641c2a", "cyan": "32b4cf", "peach": "f5c0a0",
    "terracotta": "b9623f", "clear": "dfe9e8", "mustard": "c99a2e", "emerald": "1f7a4d", "rust": "9c4a2a", "ruby": "8f1830",
    "sapphire": "1c3f94", "off white": "f4efdf", "rose gold": "b9807a", "steel blue": "4a7296", "steel grey": "71777b",
    "sky blue": "7fb8e0", "royal blue": "2a4fc0", "baby blue": "a9cbe8", "cobalt blue": "1f46a0", "hot pink": "e0408f",
    "forest green": "24562f", "brick red": "9a3b2c", "wine red": "641c2a", "cherry red": "a81a2c", "sage": "9ba88d",
    "mauve": "b08ea2", "fuchsia": "b8287f", "plum": "5e2f52", "salmon": "f08c7a", "taupe": "8b7d6f", "graphite": "4b4d50",
    "azure": "4a90d9", "aquamarine": "7fd4bd", "chartreuse": "b5cc3a", "ochre": "c28a2e", "umber": "5f4636",
}  # fmt: skip
"""sRGB by one or two words."""
BASIC_COLORS = frozenset(
    ("white", "black", "grey", "red", "orange", "yellow", "green", "blue", "purple", "pink", "brown", "beige")
)
"""Hues that a second word can specify: olive green is olive."""
CLEAR = "clear"
BARE_METALS = frozenset(("stainless steel", "chrome", "brass", "copper", "bronze"))
"""Metals that are not painted: a green watering can is made of sheet steel or plastic."""
METAL_COLORS = frozenset(("gold", "silver", "bronze", "copper", "rose gold"))
"""Colours that mean the metal itself for objects that may be metallic."""
SAME_COLOR = {"gray": "grey", "silvery": "silver", "golden": "gold", "rose": "pink", "crimson": "red", "scarlet": "red"}
SAME_COLOR |= {"amber": "orange", "aqua": "cyan", "indigo": "navy", "lilac": "lavender", "transparent": "clear"}
SAME_COLOR |= {"see through": "clear", "steel gray": "steel grey", "offwhite": "off white", "colorless": "clear"}
SHADES = {
    "light": 0.45,
    "pale": 0.6,
    "pastel": 0.5,
    "dark": -0.45,
    "deep": -0.3,
    "bright": 0.0,
    "matte": 0.0,
    "matt": 0.0,
}
SHADES |= {"glossy": 0.0, "shiny": 0.0}
"""Shift of a colour towards white (positive) or black (negative) by a preceding word."""


@dataclass(frozen=True)
class Look:
    """Appearance and material of a part: ``rgb`` sRGB in 0..1, PBR factors, a surface of the priors' materials, density, and
    ``wall``, the usual wall thickness relative to ceramic (sheet metal is thin).
    """

    material: str
    surface: str
    rgb: tuple[float, float, float]
    roughness: float
    metallic: float
    density_kg_m3: float
    wall: float = 1.0

    def colored(self, rgb: tuple[float, float, float]) -> Look:
        """Return the same material in another colour."""
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
        _look("acrylic", "plastic", "e4ecec", 0.1, 1180),
        _look("nylon", "plastic", "2a2b2d", 0.5, 1140),
        _look("polycarbonate", "plastic", "e0e8e8", 0.15, 1200),
        _look("resin", "plastic", "d9cfb8", 0.35, 1150),
        _look("fibreglass", "plastic", "d9cfa0", 0.4, 1900),
        _look("carbon fibre", "plastic", "222326", 0.3, 1600),
        _look("silicone", "rubber", "8f9598", 0.7, 1150),
        _look("rubber", "rubber", "232325", 0.85, 1150),
        _look("foam", "foam", "e7c94a", 0.95, 60),
        _look("styrofoam", "foam", "f2f2ee", 0.9, 40),
        _look("stainless steel", "steel", "b9bbbd", 0.25, 7850, 1.0),
        _look("steel", "steel", "a6a8aa", 0.35, 7850, 1.0),
        _look("chrome", "steel", "cfd1d3", 0.08, 7850, 1.0),
        _look("iron", "steel", "4a4a4c", 0.6, 7300, 1.0),
        _look("cast iron", "steel", "2c2c2e", 0.75, 7200, 0.6),
        _look("enamel", "steel", "e9ecec", 0.2, 7600),
        _look("enamelled cast iron", "steel", "e9ecec", 0.2, 7100),
        _look("titanium", "aluminium", "8f8d88", 0.35, 4500, 1.0),
        _look("pewter", "steel", "9b9c98", 0.4, 7300, 1.0),
        _look("bronze", "steel", "8c6a3a", 0.35, 8800, 1.0),
        _look("sterling silver", "steel", "d3d4d4", 0.2, 10360, 1.0),
        _look("solid gold", "steel", "c39a33", 0.2, 15500, 1.0),
        _look("aluminium", "aluminium", "c2c4c6", 0.35, 2700, 1.0),
        _look("brass", "steel", "c09a4a", 0.3, 8500, 1.0),
        _look("copper", "steel", "b4693f", 0.3, 8900, 1.0),
        _look("wood", "wood", "b08455", 0.65, 650),
        _look("bamboo", "wood", "d2b072", 0.6, 700),
        _look("oak", "wood", "b58d5e", 0.6, 720),
        _look("walnut", "wood", "5f4029", 0.55, 640),
        _look("pine", "wood", "d9b67e", 0.65, 510),
        _look("beech", "wood", "cfa272", 0.6, 720),
        _look("maple", "wood", "dcb98a", 0.55, 700),
        _look("birch", "wood", "dfc49a", 0.6, 670),
        _look("teak", "wood", "9b6a3c", 0.55, 660),
        _look("olive wood", "wood", "b98a4e", 0.5, 900),
        _look("acacia", "wood", "8a5a34", 0.55, 700),
        _look("mahogany", "wood", "6b3421", 0.5, 600),
        _look("hickory", "wood", "c9a26b", 0.6, 820),
        _look("rosewood", "wood", "5b3326", 0.5, 850),
        _look("cedar", "wood", "b5764a", 0.6, 380),
        _look("spruce", "wood", "dfc79b", 0.65, 430),
        _look("rubberwood", "wood", "d3b384", 0.6, 600),
        _look("ebony", "wood", "2b211d", 0.45, 1050),
        _look("cork", "foam", "b78c5c", 0.9, 200),
        _look("cardboard", "cardboard", "b08d5f", 0.85, 690),
        _look("paper", "paper", "f3f1ea", 0.9, 800),
        _look("leather", "leather", "6b4226", 0.6, 900),
        _look("fabric", "textile", "7f8fa3", 0.95, 400),
        _look("bristle", "textile", "e6dfc8", 0.9, 300),
        _look("wax", "wax", "f1ead6", 0.5, 900),
        _look("stone", "stone", "85837e", 0.8, 2600),
        _look("marble", "stone", "e3e1dc", 0.3, 2700),
        _look("granite", "stone", "6f6d6b", 0.5, 2700),
        _look("slate", "stone", "46494c", 0.7, 2750),
        _look("concrete", "stone", "a3a19b", 0.85, 2300),
        _look("soap", "wax", "e7d9c3", 0.45, 1050),
        _look("electronics", "plastic", "26272a", 0.35, 1800),
    )
}
"""Looks by material word, in the material's usual colour."""
FOODS: dict[str, Look] = {
    look.material: look
    for look in (
        _look("apple flesh and skin", "food skin", "b3202a", 0.35, 850),
        _look("citrus peel and flesh", "food skin", "ee8a1c", 0.5, 930),
        _look("fruit flesh and skin", "food skin", "e8b04a", 0.5, 970),
        _look("berry flesh", "food skin", "c41f2b", 0.4, 850),
        _look("vegetable flesh", "food skin", "c8a878", 0.6, 1050),
        _look("hollow vegetable flesh", "food skin", "b3261e", 0.3, 450),
        _look("onion layers", "food skin", "b8752e", 0.4, 950),
        _look("spongy flesh", "food skin", "e8e0d0", 0.6, 680),
        _look("pumpkin with its hollow", "food skin", "d9721c", 0.55, 720),
        _look("plant stalk", "food skin", "6b4a2c", 0.8, 700),
        _look("plant leaf", "food skin", "4c8a34", 0.6, 700),
        _look("egg in its shell", "ceramic", "e9c9a4", 0.55, 1070),
        _look("bread", "food skin", "b5773a", 0.85, 270),
        _look("fried dough", "food skin", "c98d4a", 0.7, 400),
        _look("baked dough", "food skin", "c4914f", 0.85, 620),
        _look("sugar glaze", "food skin", "ea8fae", 0.3, 1200),
        _look("cheese", "food skin", "f0c452", 0.5, 1070),
        _look("chocolate", "food skin", "4a2818", 0.35, 1250),
        _look("sausage meat", "food skin", "a8502f", 0.35, 1000),
        _look("grilled patty", "food skin", "553220", 0.8, 950),
        _look("ice cream", "food skin", "f3e6c8", 0.6, 600),
        _look("flavoured ice", "food skin", "e0553d", 0.25, 900),
        _look("wafer", "food skin", "cf9a55", 0.8, 350),
        _look("boiled sugar", "food skin", "d43b4a", 0.15, 1450),
        _look("butter", "food skin", "f3dc8c", 0.45, 930),
        _look("boiled rice", "food skin", "f3f0e6", 0.7, 1050),
        _look("raw fish", "food skin", "ee8a5e", 0.35, 1060),
    )
}
"""Looks of food, used by template tables but not in texts: a "chocolate mug" is not made of chocolate. Each is a whole piece with
its air and skin; densities are the usual ones of ``prior_tables/food.toml`` or within its intervals.
"""
SAME_MATERIAL = {
    "wooden": "wood", "metal": "stainless steel", "metallic": "stainless steel", "stainless": "stainless steel",
    "inox": "stainless steel", "plastics": "plastic", "aluminum": "aluminium", "tin": "steel", "clay": "earthenware",
    "pottery": "stoneware", "china": "porcelain", "woolen": "fabric", "cloth": "fabric", "textile": "fabric",
    "carton": "cardboard", "rubbery": "rubber", "glassy": "glass", "enamelled": "enamel", "enameled": "enamel",
    "enamelled steel": "enamel", "enameled steel": "enamel", "enamel steel": "enamel", "enamelled metal": "enamel",
    "enamelled iron": "enamelled cast iron", "enameled iron": "enamelled cast iron",
    "enameled cast iron": "enamelled cast iron", "enamel cast iron": "enamelled cast iron",
    "inox steel": "stainless steel", "chromed": "chrome", "chromium": "chrome", "bone china": "porcelain",
    "terracotta": "earthenware", "terra cotta": "earthenware", "faience": "earthenware", "borosilicate": "glass",
    "borosilicate glass": "glass", "pyrex": "glass", "crystal": "glass", "perspex": "acrylic", "plexiglass": "acrylic",
    "acrylic glass": "acrylic", "polypropylene": "plastic", "polyethylene": "plastic", "pvc": "plastic", "vinyl": "plastic",
    "bakelite": "plastic", "abs": "plastic", "polystyrene": "plastic", "petg": "plastic", "hdpe": "plastic", "ldpe": "plastic",
    "polyester": "fabric", "neoprene": "rubber",
    "fiberglass": "fibreglass", "glass fibre": "fibreglass", "glass fiber": "fibreglass",
    "carbon fiber": "carbon fibre", "carbon steel": "steel", "tool steel": "steel", "chrome vanadium": "steel",
    "chrome vanadium steel": "steel", "tempered glass": "glass", "toughened glass": "glass",
    "cotton": "fabric", "linen": "fabric", "felt": "fabric", "canvas": "fabric", "denim": "fabric",
    "wool": "fabric", "latex": "rubber", "suede": "leather", "oakwood": "oak", "oaken": "oak", "pinewood": "pine",
    "timber": "wood", "hardwood": "wood", "plywood": "wood", "cherry wood": "wood", "rubber wood": "rubberwood",
    "cement": "concrete", "ceramics": "ceramic", "earthen": "earthenware", "aluminium alloy": "aluminium",
    "solid silver": "sterling silver",
}  # fmt: skip
PRECIOUS_METALS = {"silver": "sterling silver", "gold": "solid gold"}
"""Colour words that name a metal after 'of': a goblet of silver."""
MATERIAL_WORDING = {"solid gold": "gold", "electronics": "plastic and electronics", "enamel": "enamelled steel"}
"""Wording of a material if it differs from the name of its look: electronics are mixed, enamel is on steel."""
USUAL_COLORS: dict[str, tuple[str, ...]] = {
    "ceramic": ("white", "red", "blue", "navy", "green", "yellow", "black"),
    "porcelain": ("white", "ivory", "light blue", "navy"),
    "stoneware": ("", "navy", "grey", "cream", "olive"),
    "earthenware": ("", "dark brown", "cream"),
    "glass": ("", "", "", "light green", "light blue"),
    "plastic": ("", "white", "black", "red", "blue", "green", "yellow", "grey"),
    "melamine": ("", "white", "red", "teal", "yellow"),
    "acrylic": ("", "", "red", "blue"),
    "nylon": ("", "grey", "red"),
    "resin": ("", "white", "black", "brown"),
    "silicone": ("", "red", "black", "teal", "green"),
    "rubber": ("", "", "grey", "red", "blue"),
    "foam": ("", "blue", "green", "pink"),
    "enamel": ("", "white", "black", "red", "navy", "cream", "green"),
    "enamelled cast iron": ("red", "navy", "cream", "orange", "black", "green"),
    "aluminium": ("", "", "charcoal", "red", "blue"),
    "wood": ("", "", "tan", "dark brown"),
    "bamboo": ("", "", "brown"),
    "cardboard": ("", "", "white"),
    "paper": ("", "white", "beige", "red", "blue"),
    "leather": ("", "black", "tan", "dark brown"),
    "fabric": ("", "white", "black", "red", "navy", "green", "beige"),
    "wax": ("", "white", "red", "green"),
    "soap": ("", "white", "mint", "lavender"),
    "marble": ("", "", "black", "grey"),
    "stone": ("", "", "charcoal", "beige"),
}
"""Usual colours of objects by material word; '' is the material's own colour. Other materials only have their own colour."""


_COLORED_IMITATIONS = frozenset(("plastic", "rubber", "foam", "ceramic", "wax", "textile", "paper", "cardboard"))
"""Surfaces on which imitation food has its natural colours: a plastic banana is yellow, a wooden one shows its wood."""


def usual_looks(look: Look, usual: Iterable[Look]) -> list[Look]:
    """Return looks of a material in the colours of an object: those among its ``usual`` looks, else the material's
    usual colours.
    """
    food = [each for each in usual if each.material in FOODS]
    if food and look.surface in _COLORED_IMITATIONS:
        return [look.colored(each.rgb) for each in food]
    own = [each for each in usual if each.material == look.material]
    seen = look.surface == "wood" or (look.surface == "steel" and look.metallic > 0)
    if len(own) > 1 and not seen:  # wood and steel named in a text stay visible: a red wooden handle would hide it
        return own
    return [look_of(f"{color} {look.material}".strip()) for color in USUAL_COLORS.get(look.material, ("",))]


def color_of(word: str) -> tuple[float, float, float] | None:
    """Return the sRGB colour of a word; None if it is no colour."""
    name = SAME_COLOR.get(word, word)
    return _rgb(COLORS[name]) if name in COLORS else None


def apply_shade(rgb: tuple[float, float, float], shade: str) -> tuple[float, float, float]:
    """Return a colour lightened or darkened by a shade word."""
    amount = SHADES[shade]
    towards = np.ones(3) if amount > 0 else np.zeros(3)
    red, green, blue = (1 - abs(amount)) * np.array(rgb) + abs(amount) * towards
    return float(red), float(green), float(blue)


def material_of(word: str) -> Look | None:
    """Return the look of the material named by one or two words; None if they name none."""
    return MATERIALS.get(SAME_MATERIAL.get(word, word))


def look_of(words: str) -> Look:
    """Return the look of 'colour material', 'material' or a food; raises ValueError for other words."""
    parts = words.split()
    for cut in range(len(parts)):
        called = " ".join(parts[cut:])
        look = FOODS.get(called) or material_of(called)
        if look is not None and cut == 0:
            return look
        rgb = color_of(parts[cut - 1]) if look is not None else None
        if look is not None and rgb is not None:
            return look.colored(apply_shade(rgb, parts[0]) if cut == 2 else rgb)
    raise ValueError(f"no look {words!r}")
