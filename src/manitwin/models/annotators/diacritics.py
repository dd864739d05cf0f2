"""Latin letters without their marks: a crème brûlée dish is found, and filed, as a creme brulee dish."""

from __future__ import annotations

import unicodedata

_WITHOUT_DECOMPOSITION = str.maketrans(
    {"ß": "ss", "æ": "ae", "œ": "oe", "ø": "o", "ł": "l", "đ": "d", "ð": "d", "þ": "th", "ı": "i"}
)


def without_diacritics(text: str) -> str:
    """Return a lower-case text with Latin letters in place of those with marks; other scripts stay as they are.

    Letters are decomposed (Unicode's NFKD) and their combining marks dropped; those without a decomposition are spelt as
    passports and addresses in ASCII do.
    """
    parts = unicodedata.normalize("NFKD", text.lower().translate(_WITHOUT_DECOMPOSITION))
    return unicodedata.normalize("NFC", "".join(c for c in parts if not 0x300 <= ord(c) <= 0x36F))
