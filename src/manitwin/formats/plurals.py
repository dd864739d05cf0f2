"""Numbers with what they count, as a person writes them."""

from __future__ import annotations


def counted(count: int, plural: str) -> str:
    """Write a number before what it counts: '1 input' and '2 inputs' of 'inputs', '1 batch' of 'batches', '1,200 rows'.

    For English plurals in -s, and in -es after ch; the last word is the one that changes.
    """
    ending = "es" if plural.endswith("ches") else "s"
    return f"{count:,} {plural.removesuffix(ending) if count == 1 else plural}"
