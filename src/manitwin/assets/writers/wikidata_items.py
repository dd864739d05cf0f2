"""Wikidata items of object categories, for formats that identify classes by them (https://www.wikidata.org, CC0)."""

from __future__ import annotations

PHYSICAL_OBJECT = "Q223557"
"""The item for categories that are not in the table: every twin is a physical object."""

ITEMS = {
    "apple": "Q89", "backpack": "Q5843", "banana": "Q503", "baseball bat": "Q809910", "baseball glove": "Q809894",
    "blender": "Q501862", "book": "Q571", "bottle": "Q80228", "bowl": "Q153988", "broccoli": "Q47722", "cake": "Q13276",
    "carrot": "Q81", "clock": "Q376", "computer mouse": "Q7987", "cup": "Q81727", "fork": "Q81881", "hammer": "Q25294",
    "handbag": "Q467505", "hat": "Q80151", "knife": "Q32489", "laptop": "Q3962", "microwave": "Q127956",
    "orange": "Q13191", "pencil": "Q14674", "pizza": "Q177", "plate": "Q57216", "remote control": "Q185091",
    "sandwich": "Q28803", "scissors": "Q40847", "shoe": "Q22676", "skateboard": "Q15783", "spoon": "Q81895",
    "suitcase": "Q200814", "teddy bear": "Q213477", "toaster": "Q14890", "toothbrush": "Q134205", "umbrella": "Q41607",
    "vase": "Q191851", "wine glass": "Q1531435",
}  # fmt: skip
"""Items by category, each looked up with its label on Wikidata."""

_HEADS = ("bottle", "bowl", "clock", "hammer", "scissors", "spoon", "vase")
"""Head nouns that determine the item of a compound: a water bottle is a bottle, but a tuning fork is not a fork."""


def item_of(category: str) -> str:
    """Return the item of a category, or that of its head noun, or that of any physical object."""
    word = category.strip().lower()
    last = word.rpartition(" ")[2]
    return ITEMS.get(word) or (ITEMS[last] if last in _HEADS else PHYSICAL_OBJECT)
