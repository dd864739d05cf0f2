"""A text-to-image model as a user program: ``command:PROGRAM {text} {out}``."""

from __future__ import annotations

from pathlib import Path

from manitwin.config import BuildConfig
from manitwin.errors import BadReply, ConfigError
from manitwin.models.generators.command import CommandGenerator


class CommandPictures(CommandGenerator):
    """Run a program that draws a text into ``{out}`` (PNG); like ``CommandGenerator``, without ``{image}``."""

    written_name = "picture.png"

    def __init__(self, command: str, config: BuildConfig):
        super().__init__(command, config)
        if "image" in self.asked_with:
            raise ConfigError("command: a picture is drawn from {text} alone; leave out {image}")

    def check(self, made: Path) -> None:
        """Raise BadReply if the file is missing; its content is checked later, as for any other model."""
        if not made.is_file():
            raise BadReply("command: the program ended well but wrote nothing to {out}; check its arguments")
