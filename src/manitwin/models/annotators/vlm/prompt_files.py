"""Prompts: editable text files with a version in the first line."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from manitwin.errors import ConfigError, unknown_name_message
from manitwin.formats.bounded_file import read_text
from manitwin.models.vlm.protocol import Picture

PLACEHOLDERS: dict[str, frozenset[str]] = {
    "quality": frozenset({"count", "name", "made_of", "pictures"}),
    "physical": frozenset({"count", "name", "size", "pictures"}),
    "captions": frozenset({"count", "name", "size", "material", "pictures"}),
    "functional_points": frozenset({"count", "name", "size", "marker", "ids", "pictures"}),
    "grasp_points": frozenset({"count", "name", "size", "opening", "pinch", "marker", "ids", "pictures"}),
    "closer_look": frozenset({"name", "size", "marker", "letters", "pictures"}),
    "template": frozenset({"given", "name", "categories", "pictures"}),
    "template_measures": frozenset({"given", "name", "category", "about", "measures", "parts", "colors", "pictures"}),
    "template_likeness": frozenset(
        {"given", "name", "category", "about", "round", "measures", "parts", "colors", "pictures"}
    ),
}
"""The prompts, with the names of the ``{placeholder}`` values that each may use."""

PICTURES = "{pictures}"
OTHERWISE = "\n# The same question in other words\n"
_MAX_BYTES = 1 << 20

_PLACEHOLDER = re.compile(r"\{([a-z_]+)\}")
_FORM = re.compile(r"version: (\S+)\n+# Instructions\n(.*)\n# Question\n(.*)", re.DOTALL)


@dataclass(frozen=True)
class Prompt:
    """A parsed prompt: system instructions, and the question with placeholders for the object's values.

    ``otherwise`` has other wordings of the question, for questions that are asked several times.
    """

    name: str
    version: str
    instructions: str
    question: str
    otherwise: tuple[str, ...] = ()

    @property
    def text(self) -> list[str]:
        """All texts of the prompt."""
        return [self.instructions, self.question, *self.otherwise]

    def filled(
        self, values: Mapping[str, str], pictures: Iterable[str | Picture], wording: int = 0
    ) -> tuple[str, tuple[str | Picture, ...]]:
        """Return the instructions, and the parts of the question with values and pictures inserted, in the given wording."""
        wordings = (self.question, *self.otherwise)
        before, after = wordings[wording % len(wordings)].split(PICTURES)
        parts = (_fill_placeholders(before, values).rstrip(), *pictures, _fill_placeholders(after, values).lstrip())
        return _fill_placeholders(self.instructions, values), parts


def _fill_placeholders(text: str, values: Mapping[str, str]) -> str:
    return _PLACEHOLDER.sub(lambda found: values[found.group(1)], text)


def load_prompts(folder: Path | None) -> dict[str, Prompt]:
    """Read all prompts; files in ``folder`` (``<name>.md``) replace the package's own.

    Raises ConfigError for a missing folder, and a file with an unknown name, an invalid form or an unknown placeholder.
    """
    own = resources.files("manitwin.models.annotators.vlm") / "prompts"
    texts = {name: (own / f"{name}.md").read_text(encoding="utf-8") for name in PLACEHOLDERS}
    if folder is not None:
        if not folder.is_dir():
            raise ConfigError(f"vlm.prompts: {folder} is no folder; give one with files such as quality.md")
        for path in sorted(folder.glob("*.md")):
            if path.stem not in PLACEHOLDERS:
                raise ConfigError(f"{path}: {unknown_name_message('prompt', path.stem, PLACEHOLDERS)}")
            texts[path.stem] = read_text(path, _MAX_BYTES, ConfigError, name=str(path))
    return {name: _parse(name, text) for name, text in texts.items()}


def _parse(name: str, text: str) -> Prompt:
    """Parse a prompt file; raises ConfigError for an invalid form or an unknown placeholder."""
    found = _FORM.fullmatch(text.replace("\r\n", "\n"))
    if found is None:
        raise ConfigError(
            f"prompt {name}.md: not a prompt; write a line 'version: 1', then '# Instructions', then '# Question'"
        )
    version, instructions = found.group(1), found.group(2).strip()
    question, *otherwise = (wording.strip() for wording in found.group(3).split(OTHERWISE))
    for word in _PLACEHOLDER.findall("\n".join([instructions, question, *otherwise])):
        if word not in PLACEHOLDERS[name]:
            raise ConfigError(f"prompt {name}.md: {unknown_name_message('placeholder', word, PLACEHOLDERS[name])}")
    if any(wording.count(PICTURES) != 1 for wording in (question, *otherwise)) or PICTURES in instructions:
        raise ConfigError(
            f"prompt {name}.md: put {PICTURES} into its question exactly once, and not into its instructions"
        )
    return Prompt(name, version, instructions, question, tuple(otherwise))
