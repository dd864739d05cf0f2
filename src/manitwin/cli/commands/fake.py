"""``manitwin fake``: a local server that keeps a service's contract, to rehearse without a key or a GPU."""

from __future__ import annotations

import signal
from typing import Annotated

import typer

from manitwin.cli import option_values
from manitwin.cli.console import out_console
from manitwin.cli.interrupt import wait_for_interrupt
from manitwin.cli.option_values import LARGEST_COUNT


def fake(
    name: Annotated[
        str | None, option_values.REHEARSALS.argument(help="Service to stand in for: openai, rodin, graspgen ...")
    ] = None,
    port: Annotated[int, typer.Option(help="Port; 0: any free port.", min=0, max=65535)] = 0,
    fault: Annotated[
        list[str] | None,
        typer.Option(help="Fault to inject: NAME in every request, NAME=2 in two; may be repeated.", metavar="FAULT"),
    ] = None,
    key: Annotated[str | None, typer.Option(help="API key that the server accepts; default: a generated key.")] = None,
    polls: Annotated[
        int | None, typer.Option(help="Number of polls before a job is done.", min=0, max=LARGEST_COUNT)
    ] = None,
    list_faults: Annotated[
        bool, typer.Option("--list-faults", help="List the faults that can be injected, and exit.")
    ] = False,
) -> None:
    """Run a rehearsal server: a local stand-in for an external service, until interrupted."""
    from manitwin.errors import UsageError
    from manitwin.models.fakes.catalog import REHEARSALS, serving
    from manitwin.models.fakes.faults import FAULTS, Faults

    if list_faults:
        for word, meaning in FAULTS.items():
            out_console.print(f"{word:<15} {meaning}")
        return
    if name is None:
        raise UsageError(f"no service given; give one of {', '.join(REHEARSALS)}")
    given = Faults.parse(fault or [])
    # an interrupt that was raised inside of a line's printing would print that line again
    with wait_for_interrupt((signal.SIGINT,)) as wait:
        with serving(name, port=port, faults=given, key=key, polls=polls) as server:
            out_console.print(f"{name} at {server.url}, until interrupted (Ctrl-C)")
            if server.key_variable is not None:
                out_console.print(f"export {server.key_variable}={server.key}")
            out_console.print(f"manitwin {server.command} {server.option} {server.spec}")
            wait()
        out_console.print("stopped")
