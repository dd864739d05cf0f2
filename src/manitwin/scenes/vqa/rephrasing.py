"""Rephrasing of questions by a model; a wording is kept only if all slots and all words that decide the answer survive."""

from __future__ import annotations

import re
import string
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict

from manitwin.formats.printable import printable_line
from manitwin.models.vlm.protocol import ChatModel, Question
from manitwin.models.vlm.strict_schema import strict_schema
from manitwin.models.vlm.structured import ask
from manitwin.scenes.vqa.templates import FAMILIES

WORDINGS = 8
"""Number of wordings that the model is asked for in each family."""
MOST_CHARACTERS = 240
FRAME_SLOTS = ("robot", "size")
"""Slots for the sentences on the robot's position and an object's size, which must come first."""
HELD_OUT_OVERLAP = 0.8
"""A wording with at least this word overlap with the held-out paraphrase (intersection over union) counts as that paraphrase."""
_SLOT = re.compile(r"\{([A-Za-z0-9]+)\}")
_DECIDING = frozenset(
    (
        "left", "right", "front", "behind", "above", "below", "under", "over", "between", "nearest", "closest",
        "farthest", "furthest", "least", "most", "more", "less", "fewer", "taller", "shorter", "higher", "lower",
        "heavier", "lighter", "greater", "smaller", "first", "last", "second", "not", "no", "never", "none", "without",
        "except", "unless", "hidden", "hides", "hide", "occluded", "visible", "covered", "free", "blocked", "avoid",
        "safe", "cm", "centimetres", "centimeters", "metres", "meters", "millimetres", "inches", "feet", "all", "every",
        "only", "both", "either", "each", "any", "robot", "camera", "picture", "image",
    )
)  # fmt: skip
"""Words that decide the answer: those in all of the family's own wordings must stay, those in none must not be added."""
_SIDES = frozenset(("left", "right"))

ASK = (
    "You reword questions about a picture of a table with objects, for training a model that looks. Names in braces such as {a}"
    " are placeholders: keep each exactly as it is, exactly once, and keep {robot} and {size}, sentences that say where the robot"
    " stands and how large a thing is, at the very beginning with no space behind it. A new wording asks for exactly the same"
    " thing and has the same answer in"
    " every picture. Use everyday English of varied style and length, one or two sentences, no numbers of your own."
    " Answer in JSON."
)
JUDGE = (
    "You check rewordings of a question about a picture of a table with objects. Names in braces are placeholders. A rewording is"
    " the same if a person who looks at any picture would have to give the same answer to both, in the same form. Name the"
    " numbers of those that are the same, and of no others. Answer in JSON."
)


class Wordings(BaseModel):
    """A model's answer: other wordings of a question."""

    model_config = ConfigDict(extra="forbid")

    wordings: list[str]


class SameQuestions(BaseModel):
    """A model's answer: the numbers of the wordings that ask the same question."""

    model_config = ConfigDict(extra="forbid")

    same: list[int]


@dataclass(frozen=True)
class Rephrasing:
    """A wording that a model gave for a family; ``dropped`` is the reason for rejection, or None."""

    family: str
    text: str
    dropped: str | None


def rephrasings(families: Iterable[str], chat: ChatModel, count: int = WORDINGS) -> list[Rephrasing]:
    """Ask a model for ``count`` wordings of each family, then which of those that pass the checks ask the same question.

    Raises the errors of the model, and BadReply for an answer that does not match the schema.
    """
    found: list[Rephrasing] = []
    for family in families:
        own = FAMILIES[family].paraphrases[:-1]
        listed = "\n".join(f"- {text}" for text in own)
        wanted = Question("vqa_wordings", ASK, (f"Give {count} other wordings of:\n{listed}",), strict_schema(Wordings))
        texts = ask(chat, wanted, Wordings).value.wordings[:count]
        checked = _checked(family, texts)
        passed = [each.text for each in checked if each.dropped is None]
        same = _same(own[0], passed, chat) if passed else frozenset()
        found += [
            Rephrasing(family, each.text, "asks_something_else")
            if each.dropped is None and each.text not in same
            else each
            for each in checked
        ]
    return found


def kept_wordings(found: Sequence[Rephrasing]) -> dict[str, tuple[str, ...]]:
    """Return the kept wordings by family."""
    kept: dict[str, tuple[str, ...]] = {}
    for each in found:
        if each.dropped is None:
            kept[each.family] = (*kept.get(each.family, ()), each.text)
    return kept


def rephrasings_json(found: Sequence[Rephrasing], model: str) -> dict[str, Any]:
    """Return the wordings of a model as JSON values: those kept, and those dropped with the reason."""
    families: dict[str, dict[str, list[Any]]] = {}
    for each in found:
        told = families.setdefault(each.family, {"kept": [], "dropped": []})
        if each.dropped is None:
            told["kept"].append(each.text)
        else:
            told["dropped"].append({"text": each.text, "reason": each.dropped})
    return {"model": model, "families": families}


def rejection_reason(family: str, text: str) -> str | None:
    """Return the reason code why a wording is rejected; None if it is accepted."""
    *own, held_out = FAMILIES[family].paraphrases
    if not 8 <= len(text) <= MOST_CHARACTERS or printable_line(text) != text or text.strip()[-1] not in "?.":
        return "no_question"
    if _slots(text) not in [_slots(each) for each in own]:
        return "slot_lost"
    if any(f"{{{slot}}}" in text and not text.startswith(f"{{{slot}}}") for slot in FRAME_SLOTS):
        return "frame_not_first"
    if re.search(r"[{}\d]", _SLOT.sub("", text)):
        return "number_of_its_own"
    words, of_own = _words(text), [_words(each) for each in own]
    if any(words == each for each in of_own):
        return "same_words"
    other = _words(held_out)
    if len(words & other) >= HELD_OUT_OVERLAP * len(words | other):
        return "held_out"
    if words & _SIDES not in [each & _SIDES for each in of_own]:
        return "meaning_changed"
    always, ever = frozenset.intersection(*of_own) & _DECIDING, frozenset.union(*of_own) & _DECIDING
    return "meaning_changed" if always - words or (words & _DECIDING) - ever else None


def fill_slots(template: str, slots: Mapping[str, str]) -> str:
    """Return a wording with its slots filled, and with a capital letter at the start of each sentence."""
    text = ""
    for part in re.split(r"(\{[A-Za-z0-9]+\})", template):
        slot = _SLOT.fullmatch(part)
        words = part if slot is None else slots[slot[1] if slot[1] in slots else slot[1].lower()]
        begins = not text.strip() or text.rstrip().endswith((".", "?", "!"))
        text += words[:1].upper() + words[1:] if begins and words[:1].isalpha() else words
    return text


def _checked(family: str, texts: Sequence[str]) -> list[Rephrasing]:
    seen: set[frozenset[str]] = set()
    checked = []
    for text in texts:
        reason = rejection_reason(family, text)
        if reason is None and _words(text) in seen:
            reason = "same_words"
        seen.add(_words(text))
        checked.append(Rephrasing(family, printable_line(text, max_characters=MOST_CHARACTERS), reason))
    return checked


def _same(original: str, texts: Sequence[str], chat: ChatModel) -> frozenset[str]:
    lines = "\n".join(f"{number}. {text}" for number, text in enumerate(texts, 1))
    question = Question("vqa_same", JUDGE, (f"The question: {original}\n{lines}",), strict_schema(SameQuestions))
    same = ask(chat, question, SameQuestions).value.same
    return frozenset(text for number, text in enumerate(texts, 1) if number in same)


def _slots(text: str) -> list[str]:
    """Return the slots of a wording; a capital slot is the same slot at the start of a sentence."""
    return sorted(name.lower() for name in _SLOT.findall(text))


def _words(text: str) -> frozenset[str]:
    for slot in FRAME_SLOTS:
        text = text.replace(f"{{{slot}}}", "")
    return frozenset(text.lower().translate(str.maketrans("", "", string.punctuation)).split())
