"""Word lists of descriptions: relative sizes, filler words, and words that introduce other objects."""

from __future__ import annotations

from collections.abc import Sequence

RELATIVE = {
    "tiny": 0.0, "small": 0.12, "little": 0.12, "mini": 0.0, "large": 0.88, "big": 0.88, "huge": 1.0, "giant": 1.0,
}  # fmt: skip
"""Position in the category's size interval for a size word: 0 smallest, 1 largest."""
FILLER_WORDS = frozenset(
    [
        "a",
        "an",
        "the",
        "one",
        "some",
        "its",
        "very",
        "and",
        "of",
        "colored",
        "coloured",
        "made",
        "with",
        "color",
        "colour",
        "that",
        "which",
        "is",
        "it",
        "out",
        "entirely",
        "all",
        "solid",
        "finish",
        "painted",
        "in",
        "for",
        "whose",
        "are",
        "from",
        ",",
        "please",
        "i",
        "want",
        "need",
        "make",
        "create",
        "generate",
        "build",
        "me",
        "my",
    ]
)
"""Words without meaning of their own."""
PURPOSE = frozenset(
    ["for", "on", "inside", "holding", "containing", "filled", "full", "to", "by", "with", "having", "without"]
)
"""Words after which the text no longer describes the object: a brush for wood is not made of it."""
PLACES = frozenset(
    [
        "next",
        "beside",
        "near",
        "behind",
        "under",
        "above",
        "below",
        "beneath",
        "between",
        "at",
        "against",
        "over",
        "lying",
        "standing",
        "sitting",
        "leaning",
        "hanging",
        "resting",
        "placed",
        "located",
        "closest",
        "nearest",
    ]
)
"""Words that, followed by a preposition or article, introduce a location: next to the stove, under a lamp."""
_OF_A_PLACE = frozenset(
    [
        "a",
        "an",
        "the",
        "my",
        "your",
        "to",
        "in",
        "on",
        "at",
        "near",
        "against",
        "from",
        "behind",
        "by",
        "under",
        "it",
        "you",
        "me",
        "that",
        "this",
        "two",
        "other",
    ]
)
CONTENTS = frozenset(
    ["soap", "wax", "paper", "clay", "cloth", "fabric", "cream", "mustard", "mint", "lime", "olive", "peach"]
)
"""Materials and colours that are contents after 'of': a bottle of soap."""


def is_other_object_start(words: Sequence[str], at: int) -> bool:
    """Return whether the text after a word describes other objects; 'full' only does before 'of' or 'with' (not in 'half full
    glass').
    """
    behind = words[at + 1] if at + 1 < len(words) else ""
    if words[at] in ("full", "filled"):
        return behind in ("of", "with")
    return words[at] in PURPOSE or (words[at] in PLACES and behind in _OF_A_PLACE)
