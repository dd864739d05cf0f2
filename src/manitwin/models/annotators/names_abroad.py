"""What the commonest things are called in other languages: whole names, where English has no such thing."""

from __future__ import annotations

import unicodedata
from functools import cache

from manitwin.errors import ManiTwinError
from manitwin.models.annotators.diacritics import without_diacritics
from manitwin.models.annotators.priors import load_names_abroad

_ARTICLES = {
    "de": ("der ", "die ", "das ", "ein ", "eine "),
    "fr": ("le ", "la ", "l'", "un ", "une "),
    "es": ("el ", "la ", "los ", "las ", "un ", "una "),
    "it": ("il ", "lo ", "la ", "l'", "gli ", "le ", "un ", "uno ", "una ", "un'"),
}


def category_abroad(name: str) -> str | None:
    """Return the category that a whole name is in one of the table's languages, with or without an article; None for others."""
    return _index().get(folded(name))


def folded(name: str) -> str:
    """Return a name as it is compared: one width of letters, lower case, without marks on Latin letters, one space a gap."""
    return " ".join(without_diacritics(unicodedata.normalize("NFKC", name)).replace("’", "'").split())


@cache
def _index() -> dict[str, str]:
    index: dict[str, str] = {}
    for category, by_language in load_names_abroad().items():
        for language, words in by_language.items():
            for word in words:
                for article in ("", *_ARTICLES.get(language, ())):
                    key = folded(article + word)
                    if index.setdefault(key, category) != category:
                        raise ManiTwinError(f"languages.toml: {word!r} names both {index[key]!r} and {category!r}")
    return index
