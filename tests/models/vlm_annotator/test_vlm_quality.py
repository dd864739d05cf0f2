"""The quality gate by eye: what is not clearly passed is failed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scripted_chat import ScriptedChat, annotator, changed, subject

from handmade import cup
from manitwin.models.annotators.protocol import QualityVerdict
from manitwin.models.annotators.vlm.prompt_files import load_prompts
from manitwin.models.vlm.protocol import Picture

CLEAN = {"evidence": "nothing seen", "severity": "none"}
GOOD: dict[str, Any] = {
    "shown": "A cup.",
    "objects_evidence": "one thing",
    "single_object": "yes",
    "fragmentation": CLEAN,
    "texture_corruption": {"evidence": "slightly soft", "severity": "minor"},
    "geometric_implausibility": CLEAN,
    "quality_evidence": "sound",
    "visual_quality": "yes",
}
SEVERE = {"evidence": "half of the wall is missing in view 3", "severity": "severe"}


def judged(folder: Path, *answers: dict[str, Any]) -> tuple[ScriptedChat, Any]:
    chat = ScriptedChat(*answers)
    return chat, annotator(chat).judge_quality(subject(cup(), folder, "cup"))


def test_clear_pass_is_asked_once(tmp_path: Path) -> None:
    chat, verdict = judged(tmp_path, GOOD)
    assert (verdict.single_object, verdict.visual_quality, len(chat.asked)) == (True, True, 1)


def test_clear_failures_are_told_apart_and_asked_once(tmp_path: Path) -> None:
    chat, verdict = judged(tmp_path, changed(GOOD, single_object="no", objects_evidence="two cups side by side"))
    assert (verdict.single_object, verdict.visual_quality, len(chat.asked)) == (False, True, 1)
    assert "two cups" in verdict.detail
    chat, verdict = judged(tmp_path, changed(GOOD, visual_quality="no", fragmentation=SEVERE))
    assert (verdict.single_object, verdict.visual_quality, len(chat.asked)) == (True, False, 1)
    assert "half of the wall" in verdict.detail


@pytest.mark.parametrize("criterion", ["single_object", "visual_quality"])
def test_unsure_is_asked_again_and_then_a_no(tmp_path: Path, criterion: str) -> None:
    unsure = changed(GOOD, **{criterion: "unsure"})
    chat, verdict = judged(tmp_path, unsure)
    assert len(chat.asked) == 2 and "unsure" in chat.complaint()
    assert getattr(verdict, criterion) is False and "unsure when asked twice" in verdict.detail
    chat, verdict = judged(tmp_path, unsure, GOOD)
    assert len(chat.asked) == 2 and verdict.single_object and verdict.visual_quality


@pytest.mark.parametrize("severity", ["severe", "unsure"])
def test_yes_against_its_own_evidence_is_a_no(tmp_path: Path, severity: str) -> None:
    chat, verdict = judged(tmp_path, changed(GOOD, fragmentation=SEVERE | {"severity": severity}))
    assert len(chat.asked) == 2 and f"fragmentation is {severity}" in chat.complaint()
    assert verdict.visual_quality is False


def test_no_without_a_severe_artifact_is_asked_again_and_stays_a_no(tmp_path: Path) -> None:
    chat, verdict = judged(tmp_path, changed(GOOD, visual_quality="no"))
    assert len(chat.asked) == 2 and verdict.visual_quality is False


def test_stripes_on_guessed_sides_are_minor_by_the_prompt() -> None:
    instructions = load_prompts(None)["quality"].instructions
    minor, severe = (
        next(line for line in instructions.splitlines() if line.startswith(f"- {k}:")) for k in ("minor", "severe")
    )
    assert "stripes" in minor and "seen at once" in minor and "seen at once" not in severe


def judged_beside_photo(folder: Path, *, photos: int = 1, **said: Any) -> tuple[ScriptedChat, QualityVerdict]:
    rgba = np.zeros((40, 60, 4), np.uint8)
    rgba[10:30, 15:45] = (200, 30, 30, 255)
    Image.fromarray(rgba).save(folder / "photo.png")
    chat = ScriptedChat(changed(GOOD, photo_evidence="the back half is cut off", **said))
    of = replace(subject(cup(), folder, "cup"), photos=(folder / "photo.png",) * photos)
    return chat, annotator(chat).judge_quality(of)


def test_photo_is_shown_beside_the_views_and_a_half_of_it_is_rejected(tmp_path: Path) -> None:
    chat, verdict = judged_beside_photo(tmp_path, like_photo="no")
    question = chat.asked[0][0]
    assert question.parts[1] == "The photo that it was made of:" and "guessed" in str(question.parts[0])
    assert sum(isinstance(part, Picture) for part in question.parts) == 9
    assert verdict.visual_quality is False and "the back half is cut off" in verdict.detail
    assert judged_beside_photo(tmp_path, like_photo="yes")[1].visual_quality is True


def test_of_many_photos_eight_are_shown_spread_over_all(tmp_path: Path) -> None:
    chat, _ = judged_beside_photo(tmp_path, photos=36, like_photo="yes")
    parts = chat.asked[0][0].parts
    assert sum(isinstance(part, Picture) for part in parts) == 16
    captions = [part for part in parts if isinstance(part, str) and part.startswith("Photo ")]
    assert captions == [f"Photo {number} of 36 that it was made of:" for number in (1, 5, 10, 14, 19, 23, 28, 32)]


def test_doubt_about_the_photo_is_asked_again_and_then_a_no(tmp_path: Path) -> None:
    chat, verdict = judged_beside_photo(tmp_path, like_photo="unsure")
    assert "like_photo is unsure" in chat.complaint() and verdict.visual_quality is False


def test_without_a_photo_none_is_asked_about(tmp_path: Path) -> None:
    chat, _ = judged(tmp_path, GOOD)
    assert "like_photo" not in chat.asked[0][0].schema["properties"]
