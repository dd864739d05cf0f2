"""``manitwin view``: a data set's gallery, its twins' pages, scenes and episodes of them, in the browser."""

from __future__ import annotations

import os
import signal
import sys
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import err_console, error_console, out_console
from manitwin.cli.interrupt import call_on_first_interrupt

if TYPE_CHECKING:
    from manitwin.web.serve import PageServer


def view(
    source: Annotated[
        str,
        options.existing_path_argument(
            "A data set with an index, one twin, scenes, or recorded episodes.",
            "DATASET|TWIN|SCENES|EPISODES",
            "a data set's, a twin's, scenes' or episodes' folder, or an HDF5 file of episodes",
        ),
    ],
    port: Annotated[int, typer.Option(help="Port; 0: any free port.", min=0, max=65535)] = 0,
    host: Annotated[
        str, typer.Option(help="Address to listen on; 0.0.0.0 lets other machines connect.", metavar="ADDRESS")
    ] = "127.0.0.1",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
    static: Annotated[
        Path | None,
        typer.Option(
            help="Write the pages as static files into this new folder, and start no server.",
            metavar="OUT",
            callback=option_values.check_output_folder,
        ),
    ] = None,
    sample: Annotated[
        int | None,
        typer.Option(
            help="With --static: number of twins, scenes or episodes to draw at random.",
            callback=option_values.count_callback("sample"),
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="With --sample: random seed.", min=0, max=options.LARGEST_SEED)] = 0,
    where: Annotated[
        str | None,
        typer.Option(
            help="With --static: only twins that satisfy this condition, as in manitwin query.", metavar="SQL"
        ),
    ] = None,
    trials: Annotated[
        int,
        typer.Option(help="With --static: number of grasps of each gripper to include as animations.", min=0, max=1000),
    ] = 0,
    twins: options.Twins = None,
) -> None:
    """Browse a data set, a twin, scenes or episodes in the browser, or write the pages as static files."""
    from manitwin.errors import UsageError

    if static is not None:
        _write(source, static, sample, seed, where or "", trials, twins)
        return
    if sample is not None or where is not None or trials:
        raise UsageError("--sample, --where and --trials need --static; in the browser, use the filters of the gallery")
    from manitwin.web.serve import serve

    def ready(server: PageServer) -> None:
        ends_with(server)
        warn_if_open(server)
        print_unlogged_link(server.link(), "until interrupted (Ctrl-C)")
        if browser and has_screen():
            webbrowser.open(server.link())

    with stop_server_on_interrupt() as ends_with:
        serve(
            source,
            host,
            port,
            ready,
            lambda link: print_unlogged_link(link, "new link, because the old one was used a second time"),
            twins,
        )
        out_console.print("stopped")


@contextmanager
def stop_server_on_interrupt() -> Iterator[Callable[[PageServer], None]]:
    """Give a function that has the first interrupt from then on end a server in order; before, it ends the command."""
    with ExitStack() as ending:

        def ends(server: PageServer) -> None:
            ending.enter_context(call_on_first_interrupt(server.stop, (signal.SIGINT, signal.SIGTERM)))

        yield ends


def _write(source: str, out: Path, sample: int | None, seed: int, where: str, trials: int, twins: str | None) -> None:
    from manitwin.web.static_pages import write_static_pages

    done = write_static_pages(source, out, sample=sample, seed=seed, where=where, trials=trials, twins=twins)
    for name, reason in done.left_out.items():
        err_console.print(f"{name} is left out: {reason}")
    pages = "".join(
        f"{count:,} {kind}, " for count, kind in ((done.scenes, "scenes"), (done.episodes, "episodes")) if count
    )
    out_console.print(
        f"{pages}{done.twins:,} twins, {done.size_bytes / 1e6:,.1f} MB, in {out}; open {out / 'index.html'}"
    )
    raise typer.Exit(3 if done.left_out else 0)


def warn_if_open(server: PageServer) -> None:
    """Warn where a server can be reached from other machines."""
    if server.names.open:
        error_console.print(
            "the server is reachable from other machines, and its traffic is not encrypted", style="yellow"
        )


def print_unlogged_link(link: str, remark: str) -> None:
    """Print a link, and write it to no log: it opens the pages to whoever has it first."""
    out_console.print(f"{link}  ({remark})", logged=False)
    sys.stdout.flush()


def has_screen() -> bool:
    """Tell whether a browser has a screen to open on: in a bare terminal a text browser would take the terminal."""
    return sys.platform in ("darwin", "win32") or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
