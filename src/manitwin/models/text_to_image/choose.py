"""Selection of the text-to-image model that the user names."""

from __future__ import annotations

from pathlib import Path

from manitwin.config import BuildConfig
from manitwin.errors import UsageError, unknown_name_message
from manitwin.models.generators.protocol import Generator
from manitwin.models.text_to_image.command import CommandPictures
from manitwin.models.text_to_image.fal import FalPictures
from manitwin.models.text_to_image.openai import OpenAiPictures

KINDS = ("command", "fal", "openai")


def choose_text_to_image(spec: str, config: BuildConfig, answers: Path) -> Generator:
    """Return the model named by ``command:PROGRAM {text} {out}``, ``fal[:ENDPOINT]`` or ``openai:MODEL[@URL]``.

    ``answers`` is the folder that stores answers which contain the picture itself. Raises UsageError for another kind,
    ConfigError for errors in the rest of the spec.
    """
    kind, _, argument = spec.partition(":")
    if kind == "command":
        return CommandPictures(argument, config)
    if kind == "fal":
        return FalPictures.from_spec(argument, config)
    if kind == "openai":
        return OpenAiPictures.from_spec(argument, config, answers)
    raise UsageError(unknown_name_message("text-to-image model", kind, KINDS))
