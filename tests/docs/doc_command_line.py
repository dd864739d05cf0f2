"""The command line's own reading of a command, without doing it."""

from __future__ import annotations

from functools import cache
from typing import Any

import typer

from manitwin.cli.main import app


@cache
def _group() -> Any:
    return typer.main.get_command(app)


def check_words(words: list[str]) -> None:
    """Parse ``manitwin ...``; other programs are none of its business. Fails for an option that it does not take."""
    if not words or words[0].rpartition("/")[2] != "manitwin":
        return
    end = next((i for i, word in enumerate(words) if word in (">", "|", "&&", ";")), len(words))
    group = _group()
    context = group.make_context("manitwin", words[1:end], resilient_parsing=True)
    _, command, rest = group.resolve_command(context, words[1:end])
    command.make_parser(command.context_class(command)).parse_args(list(rest))
