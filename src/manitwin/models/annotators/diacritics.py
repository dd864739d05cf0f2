"""Removal of diacritics from Latin letters, so that a crème brûlée dish is found as a creme brulee dish."""

from __future__ import annotations

import unicodedata

_WITHOUT_DECOMPOSITION = str.maketrans(
    {"ß": "ss", "æ": "ae", "œ": "oe", "ø": "o", "ł": "l", "đ": "d", "ð": "d", "þ": "th", "ı": "i"}
)


def remove_diacritics(text: str) -> str:
    """Return a text in lower case with Latin letters without diacritics; other scripts are unchanged.

    Letters are decomposed (Unicode NFKD) and combining marks removed; letters without a decomposition are transliterated as
    in passports and ASCII addresses.
    """
    parts = unicodedata.normalize("NFKD", text.lower().translate(_WITHOUT_DECOMPOSITION))
    return unicodedata.normalize("NFC", "".join(c for c in parts if not 0x300 <= ord(c) <= 0x36F))
