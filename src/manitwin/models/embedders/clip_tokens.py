"""Tokenizer of CLIP's text network: byte-pair encoding of lower-case text (Radford et al. 2021, section 2.4).

The vocabulary and the ranks of its merges are the files ``vocab.json`` and ``merges.txt`` in the model's folder, in Hugging
Face's format. Text is split as in https://github.com/openai/CLIP/blob/main/clip/simple_tokenizer.py.
"""

from __future__ import annotations

import html
import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from manitwin.errors import UsageError
from manitwin.formats.csv_file import read_lines
from manitwin.formats.json_file import read_json_object

LENGTH = 77
"""Tokens that CLIP's text network takes, including begin and end."""
BEGIN, END = "<|startoftext|>", "<|endoftext|>"
_WORD_END = "</w>"
_SUFFIXES = ("'s", "'t", "'re", "'ve", "'m", "'ll", "'d")


@dataclass(frozen=True)
class ClipTokens:
    """A vocabulary ``{token: id}`` and the rank of each merge of two tokens."""

    vocabulary: dict[str, int]
    ranks: dict[tuple[str, str], int]

    @classmethod
    def of_folder(cls, folder: Path) -> ClipTokens:
        """Read ``vocab.json`` and ``merges.txt``; raises UsageError for invalid files."""
        said = read_json_object(folder / "vocab.json", UsageError)
        if not all(type(value) is int for value in said.values()) or not {BEGIN, END} <= said.keys():
            raise UsageError(f"{folder / 'vocab.json'}: is not a CLIP vocabulary; give tokens with their numbers")
        lines = [line.split() for line in read_lines(folder / "merges.txt", UsageError) if line[:1] != "#"]
        pairs = [(line[0], line[1]) for line in lines if len(line) == 2]
        return cls({name: int(value) for name, value in said.items()}, {pair: rank for rank, pair in enumerate(pairs)})

    def encode(self, text: str, length: int = LENGTH) -> np.ndarray:
        """Return the token ids ``(length,) int64`` of a text, truncated, or padded with the id of the end token.

        Raises UsageError for a text with a token that is not in the vocabulary.
        """
        tokens = [token for word in words(text) for token in self._merged(word)]
        unknown = [token for token in tokens if token not in self.vocabulary]
        if unknown:
            raise UsageError(f"vocab.json: has no token {unknown[0]!r}; give the vocabulary of the model's own folder")
        ids = [self.vocabulary[name] for name in (BEGIN, *tokens[: length - 2], END)]
        return np.array(ids + [self.vocabulary[END]] * (length - len(ids)), np.int64)

    def _merged(self, word: str) -> list[str]:
        """Merge the characters of a word into tokens, the merge of lowest rank first."""
        characters = [_BYTES[byte] for byte in word.encode()]
        parts = [*characters[:-1], characters[-1] + _WORD_END]
        while len(parts) > 1:
            pairs = list(pairwise(parts))
            best = min(pairs, key=lambda pair: self.ranks.get(pair, len(self.ranks)))
            if best not in self.ranks:
                break
            joined, place = [], 0
            while place < len(parts):
                if tuple(parts[place : place + 2]) == best:
                    joined.append("".join(best))
                    place += 2
                else:
                    joined.append(parts[place])
                    place += 1
            parts = joined
        return parts


def words(text: str) -> Iterator[str]:
    """Yield the parts into which a text is split: words, single digits, runs of other characters, and English contractions."""
    plain = re.sub(r"\s+", " ", html.unescape(html.unescape(text))).strip().lower()
    place = 0
    while place < len(plain):
        suffix = next((each for each in _SUFFIXES if plain.startswith(each, place)), None)
        kind = _kind(plain[place])
        end = place + 1
        if suffix is not None:
            end = place + len(suffix)
        elif kind in ("letter", "sign"):
            while end < len(plain) and _kind(plain[end]) == kind:
                end += 1
        if kind != "space":
            yield plain[place:end]
        place = end


def _kind(character: str) -> str:
    category = unicodedata.category(character)
    if character.isspace():
        return "space"
    return {"L": "letter", "N": "number"}.get(category[0], "sign")


def _byte_characters() -> dict[int, str]:
    """Return the printable character that represents each byte (GPT-2's table)."""
    shown = [*range(ord("!"), ord("~") + 1), *range(ord("¡"), ord("¬") + 1), *range(ord("®"), ord("ÿ") + 1)]
    others = [byte for byte in range(256) if byte not in shown]
    return {byte: chr(byte) for byte in shown} | {byte: chr(256 + place) for place, byte in enumerate(others)}


_BYTES = _byte_characters()
