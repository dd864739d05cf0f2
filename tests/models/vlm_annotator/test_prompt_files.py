"""Prompts as files: read, replaced, refused, and part of what decides a twin."""

from __future__ import annotations

from pathlib import Path

import pytest
from scripted_chat import ScriptedChat

from manitwin.config import BuildConfig, ServicesConfig, VlmConfig
from manitwin.errors import ConfigError
from manitwin.models.annotators.vlm.annotator import PROMPTS, VlmAnnotator
from manitwin.models.annotators.vlm.prompt_files import PLACEHOLDERS, load_prompts
from manitwin.models.vlm.prices import TokenPrice
from manitwin.models.vlm.protocol import Picture

SMALL = "version: 7\n\n# Instructions\n\nLook.\n\n# Question\n\nOf {count}: {name}\n\n{pictures}\n\nJudge.\n"


def test_each_prompt_uses_all_that_it_is_given() -> None:
    for name, prompt in load_prompts(None).items():
        for placeholder in PLACEHOLDERS[name]:
            assert f"{{{placeholder}}}" in prompt.instructions + prompt.question, (name, placeholder)


def test_pictures_stand_between_the_text() -> None:
    values = {"count": "8", "name": "It is called {count}.", "made_of": ""}
    instructions, parts = load_prompts(None)["quality"].filled(values, ["View 1:", Picture(b"x")])
    assert parts[1:3] == ("View 1:", Picture(b"x")) and len(parts) == 4 and instructions.startswith("You inspect")
    assert "It is called {count}." in str(parts[0]), "what is put in is not filled again"


def test_file_in_the_folder_replaces_the_prompt_and_what_decides(tmp_path: Path) -> None:
    (tmp_path / "quality.md").write_text(SMALL)
    own, other = (VlmAnnotator(ScriptedChat({}), BuildConfig(vlm=VlmConfig(prompts=p))) for p in (None, tmp_path))
    assert other.prompts["quality"].instructions == "Look."
    assert other.model_for("quality").startswith("eyes-1, prompt quality v7 ")
    changed = [question for question in PROMPTS if own.model_for(question) != other.model_for(question)]
    assert changed == ["quality"]


def test_settings_that_decide_answers_are_part_of_it_and_those_of_services_are_not() -> None:
    def model(config: BuildConfig) -> dict[str, str]:
        return {question: VlmAnnotator(ScriptedChat({}), config).model_for(question) for question in PROMPTS}

    own = model(BuildConfig())
    assert model(BuildConfig(services=ServicesConfig(retries=0))) == own
    warmer, voted = model(BuildConfig(vlm=VlmConfig(temperature=0.5))), model(BuildConfig(vlm=VlmConfig(votes=5)))
    assert all(warmer[question] != own[question] for question in PROMPTS)
    assert [question for question in PROMPTS if voted[question] != own[question]] == ["points"]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("qualty.md", SMALL, "did you mean 'quality'"),
        ("quality.md", SMALL.replace("{name}", "{nam}"), "did you mean 'name'"),
        ("quality.md", SMALL.replace("{pictures}", ""), "exactly once"),
        ("quality.md", SMALL.replace("version: 7", ""), "version: 1"),
    ],
)
def test_unusable_prompt_is_refused_by_name(tmp_path: Path, name: str, text: str, said: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(ConfigError, match=said):
        load_prompts(tmp_path)


def test_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"vlm\.prompts"):
        load_prompts(tmp_path / "none")


def test_expected_cost_counts_text_pictures_and_votes() -> None:
    chat = ScriptedChat({})
    assert VlmAnnotator(chat, BuildConfig()).expected_usd("quality") == 0, "without a price nothing is charged"
    chat.price = TokenPrice(1.0, 0.0)  # type: ignore[attr-defined]
    usd = {question: VlmAnnotator(chat, BuildConfig()).expected_usd(question) for question in PROMPTS}
    pictures = 8 * 28 * 28 / 1e6  # 768 px are 28 patches of 28 px
    assert pictures < usd["quality"] < 1.6 * pictures
    three, one = (VlmAnnotator(chat, BuildConfig(vlm=VlmConfig(votes=v))).expected_usd("points") for v in (3, 1))
    assert three == usd["points"] and 16 * 28 * 28 * 2 / 1e6 < three - one < 2 * 16e-3 + 3e-3
