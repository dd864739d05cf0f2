"""Phrases stand behind "the" in an instruction, are all different, and the same every time."""

from __future__ import annotations

import pytest

from manitwin.assets.writers.robotwin import noun_phrases, split_phrases
from manitwin.errors import ExportError
from manitwin.twin.record import Language

MUG = Language(
    category="mug", color="white", material="ceramic", size="10 cm high", shape="a cylinder with a handle",
    function="drinking", caption="A white mug.",
    captions=["Pick up the mug.", "The mug is on the table.", "a big mug with a blue rim", "It holds coffee. A mug."],
)  # fmt: skip


def test_captions_that_name_the_object_come_first_and_without_article() -> None:
    assert noun_phrases(MUG, 2) == ["white mug", "big mug with a blue rim"]


def test_commands_and_sentences_are_left_out() -> None:
    phrases = " | ".join(noun_phrases(MUG, 15))
    assert "Pick" not in phrases and "table" not in phrases and "coffee" not in phrases


@pytest.mark.parametrize("color", ["white", "unknown color (untextured)"])
def test_seen_and_unseen_are_disjoint_and_complete(color: str) -> None:
    seen, unseen = split_phrases(MUG.model_copy(update={"color": color, "captions": []}), 12, 3)
    assert len(set(seen)) == 12 and len(set(unseen)) == 3
    assert not {s.lower() for s in seen} & {s.lower() for s in unseen}
    assert not any("unknown" in phrase for phrase in seen + unseen)


def test_equal_attributes_are_an_error_rather_than_repetition() -> None:
    same = Language(category="x", color="x", material="x", size="x", shape="x", function="x", caption="x", captions=[])
    with pytest.raises(ExportError, match="phrases for 'x'"):
        noun_phrases(same, 40)


def test_function_with_its_own_preposition_is_not_given_another() -> None:
    phrases = noun_phrases(MUG.model_copy(update={"function": "to drink from"}), 15)
    assert "mug to drink from" in phrases
    assert not any("for to" in phrase for phrase in phrases)


def test_line_breaks_do_not_get_into_phrases() -> None:
    phrases = noun_phrases(MUG.model_copy(update={"shape": "round\nand hollow"}), 15)
    assert "mug, round and hollow" in phrases
