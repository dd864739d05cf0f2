"""Counts with singular or plural nouns."""

from __future__ import annotations


def counted(count: int, plural: str) -> str:
    """Format a count with its noun: '1 input' and '2 inputs' for 'inputs', '1 batch' for 'batches', '1,200 rows'.

    Supports English plurals in -s, and in -es after ch; the last word is inflected.
    """
    ending = "es" if plural.endswith("ches") else "s"
    return f"{count:,} {plural.removesuffix(ending) if count == 1 else plural}"
