"""Names of common objects in other languages: only whole names are looked up, after no English name was found."""

from __future__ import annotations

import unicodedata
from functools import cache

from manitwin.errors import ManiTwinError
from manitwin.models.annotators.diacritics import remove_diacritics
from manitwin.models.annotators.priors import load_names_abroad

_ARTICLES = {
    "de": ("der ", "die ", "das ", "ein ", "eine "),
    "fr": ("le ", "la ", "l'", "un ", "une "),
    "es": ("el ", "la ", "los ", "las ", "un ", "una "),
    "it": ("il ", "lo ", "la ", "l'", "gli ", "le ", "un ", "uno ", "una ", "un'"),
}


def category_of_foreign_name(name: str) -> str | None:
    """Return the category with this whole name, with or without article, in one of the table's languages; else None."""
    return _index().get(fold_name(name))


def fold_name(name: str) -> str:
    """Return a name in the form in which it is compared: NFKC, lower case, no diacritics on Latin letters, single spaces."""
    return " ".join(remove_diacritics(unicodedata.normalize("NFKC", name)).replace("’", "'").split())


@cache
def _index() -> dict[str, str]:
    index: dict[str, str] = {}
    for category, by_language in load_names_abroad().items():
        for language, words in by_language.items():
            for word in words:
                for article in ("", *_ARTICLES.get(language, ())):
                    key = fold_name(article + word)
                    if index.setdefault(key, category) != category:
                        raise ManiTwinError(f"languages.toml: {word!r} names both {index[key]!r} and {category!r}")
    return index
