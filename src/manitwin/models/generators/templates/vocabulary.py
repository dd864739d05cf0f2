"""Words by what they do in a description: sizes, words that say nothing, and words behind which others are spoken of."""

from __future__ import annotations

from collections.abc import Sequence

RELATIVE = {
    "tiny": 0.0, "small": 0.12, "little": 0.12, "mini": 0.0, "large": 0.88, "big": 0.88, "huge": 1.0, "giant": 1.0,
}  # fmt: skip
"""Where in the interval of a category's sizes a word puts a thing: 0 the least, 1 the largest."""
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
"""Words that say nothing themselves."""
PURPOSE = frozenset(
    ["for", "on", "inside", "holding", "containing", "filled", "full", "to", "by", "with", "having", "without"]
)
"""What is behind these says nothing of the thing itself: a brush for wood is not of it."""
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
"""What is behind these, and a preposition or an article, is where the thing is: next to the stove, under a lamp."""
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
"""Materials and colours that behind 'of' are what is in a thing: a bottle of soap."""


def speaks_of_others(words: Sequence[str], at: int) -> bool:
    """Tell whether what is behind a word speaks of other things: not behind 'full' in a half full glass, a stapler full strip."""
    behind = words[at + 1] if at + 1 < len(words) else ""
    if words[at] in ("full", "filled"):
        return behind in ("of", "with")
    return words[at] in PURPOSE or (words[at] in PLACES and behind in _OF_A_PLACE)
