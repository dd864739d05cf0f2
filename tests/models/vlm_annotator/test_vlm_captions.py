"""Words that a model writes: what may not stay in them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scripted_chat import ScriptedChat, annotator, changed, subject

from handmade import cup
from manitwin.errors import BadReply
from manitwin.twin.record import Language

EXTENTS_M = np.array([0.08, 0.08, 0.1])
GOOD: dict[str, Any] = {
    "shown": "A white cup.",
    "same_as_named": "yes",
    "category": "cup",
    "color": "white",
    "material": "ceramic",
    "size": "10 x 8 x 8 cm, hand-sized",
    "shape": "cylindrical, open at the top",
    "function": "drinking",
    "caption": "A white ceramic cup for hot drinks.",
    "label": "white cup",
    "sentence": "This plain white cup has no handle at all.",
    "detailed": "A plain cylinder of white ceramic, open at the top and flat at the bottom. The wall is even and thin.",
    "by_use": "Fill it with tea and drink from its rim.",
    "by_look": "Something white, round and open at one end.",
    "by_size": "Ten centimetres of ceramic, 10 cm tall and 8 cm across.",
    "request": "Hand me the white cup without a handle.",
}


def described(folder: Path, *answers: dict[str, Any], name: str | None = "cup") -> tuple[ScriptedChat, Language]:
    chat = ScriptedChat(*answers)
    return chat, annotator(chat).describe(subject(cup(), folder, name), "ceramic", EXTENTS_M)


def test_good_words_are_taken_as_they_are(tmp_path: Path) -> None:
    chat, language = described(tmp_path, GOOD)
    assert len(chat.asked) == 1 and language.captions[0] == language.caption == GOOD["caption"]
    assert len(set(language.captions)) == 8 and language.category == "cup"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("A white cup seen in eight views.", "views"),
        ("The picture shows a white cup.", "picture"),
        ("A white cup on a grey background.", "background"),
        ("A rendered 3D model of a cup.", "rendered"),
        ("A white cup with the numbered rim 12.", "numbered"),
        ("A white cup that is 35 cm tall.", "35 cm"),
        ("A white cup with a wall of 2 mm.", "2 mm"),
        ("A white cup, 4 inches tall by 9 inches.", "9 inches"),
    ],
)
def test_words_about_showing_and_wrong_lengths_are_asked_again_and_left_out(
    tmp_path: Path, text: str, said: str
) -> None:
    chat, language = described(tmp_path, changed(GOOD, caption=text))
    assert len(chat.asked) == 2 and f"caption: '{said}'" in chat.complaint().replace(
        f"caption: {said}", f"caption: '{said}'"
    )
    assert text not in language.captions and language.caption == GOOD["label"] and len(language.captions) == 7
    _, language = described(tmp_path, changed(GOOD, caption=text), GOOD)
    assert language.caption == GOOD["caption"]


def test_a_thing_may_be_called_what_it_is(tmp_path: Path) -> None:
    camera = {field: text.replace("cup", "camera") for field, text in GOOD.items()}
    chat, language = described(tmp_path, camera, name="camera")
    assert len(chat.asked) == 1 and len(language.captions) == 8


def test_repeated_sentence_is_asked_again_and_left_out(tmp_path: Path) -> None:
    chat, language = described(tmp_path, changed(GOOD, by_look="The white ceramic cup, for hot drinks"))
    assert len(chat.asked) == 2 and "by_look repeats caption" in chat.complaint()
    assert len(language.captions) == 7


def test_too_few_usable_sentences_are_no_answer(tmp_path: Path) -> None:
    same = dict.fromkeys(("label", "sentence", "by_look"), GOOD["caption"])
    with pytest.raises(BadReply, match="only 5 of"):
        described(tmp_path, changed(GOOD, **same))


def test_attribute_about_showing_is_no_answer(tmp_path: Path) -> None:
    with pytest.raises(BadReply, match="color"):
        described(tmp_path, changed(GOOD, color="white with a grey background"))


def test_name_is_not_contradicted_in_silence(tmp_path: Path) -> None:
    other = changed(GOOD, same_as_named="no", category="vase")
    chat, language = described(tmp_path, other)
    assert len(chat.asked) == 2 and "'cup'" in chat.complaint() and "'vase'" in chat.complaint()
    assert language.category == "vase (the user says cup)"
    _, language = described(tmp_path, other, GOOD)
    assert language.category == "cup"


def test_measures_and_material_are_told(tmp_path: Path) -> None:
    chat, _ = described(tmp_path, GOOD)
    assert "8.0 x 8.0 x 10.0 cm" in str(chat.asked[0][0].parts[0]) and "estimated as ceramic" in str(
        chat.asked[0][0].parts[0]
    )
