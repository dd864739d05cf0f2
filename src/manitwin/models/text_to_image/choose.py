"""Choose who draws pictures by what a person writes."""

from __future__ import annotations

from pathlib import Path

from manitwin.config import BuildConfig
from manitwin.errors import UsageError, choose_from
from manitwin.models.generators.protocol import Generator
from manitwin.models.text_to_image.command import CommandPictures
from manitwin.models.text_to_image.fal import FalPictures
from manitwin.models.text_to_image.openai import OpenAiPictures

KINDS = ("command", "fal", "openai")


def choose_text_to_image(spec: str, config: BuildConfig, answers: Path) -> Generator:
    """Return who ``command:PROGRAM {text} {out}``, ``fal[:ENDPOINT]`` or ``openai:MODEL[@URL]`` names.

    ``answers`` is the folder for answers that are pictures themselves. Raises UsageError for another kind, ConfigError for what
    is wrong with the rest.
    """
    kind, _, argument = spec.partition(":")
    if kind == "command":
        return CommandPictures(argument, config)
    if kind == "fal":
        return FalPictures.from_spec(argument, config)
    if kind == "openai":
        return OpenAiPictures.from_spec(argument, config, answers)
    raise UsageError(choose_from("text-to-image model", kind, KINDS))
