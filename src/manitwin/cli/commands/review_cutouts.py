"""``manitwin review cutouts``: people look at cut-outs of rejected photos, or draw them anew, and what is right is built."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import options
from manitwin.cli.commands.review import Dataset
from manitwin.cli.console import out_console, print_error

if TYPE_CHECKING:
    from manitwin.dataset.review.outlines import OutlineSession
    from manitwin.engine.drive import RunReport
    from manitwin.web.serve import PageServer

PICTURES = (".png", ".webp", ".jpg")


def review_cutouts(
    dataset: Dataset,
    sheet: Annotated[
        Path | None,
        typer.Option(
            help="Draw the cut-outs side by side into this file; more than 48 go to further sheets.",
            metavar="FILE.png",
            dir_okay=False,
        ),
    ] = None,
    accept: Annotated[
        list[str] | None,
        typer.Option(
            help="Photo whose cut-out you have checked and found right: build it; may be repeated.",
            metavar="ID",
        ),
    ] = None,
    draw: Annotated[
        bool,
        typer.Option(
            "--draw",
            help="Redraw outlines and name objects in the browser, until interrupted; then build the photos.",
        ),
    ] = False,
    redraw: Annotated[
        list[str] | None,
        typer.Option(
            help="With --draw: also show this photo, whose cut-out was accepted; may be repeated.", metavar="ID"
        ),
    ] = None,
    annotator: Annotated[str, typer.Option(help="Name of the person who checked the cut-outs.", metavar="NAME")] = "me",
    port: Annotated[int, typer.Option(help="With --draw: port; 0: any free port.", min=0, max=65535)] = 0,
    host: Annotated[
        str,
        typer.Option(help="With --draw: address to listen on; 0.0.0.0 lets other machines connect.", metavar="ADDRESS"),
    ] = "127.0.0.1",
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="With --draw: open the page in the browser.")
    ] = True,
    jobs: options.Jobs = None,
) -> None:
    """List photos rejected for a doubtful cut-out, draw the cut-outs, or build those that you accept."""
    from manitwin.errors import UsageError

    if sheet is not None and sheet.suffix.lower() not in PICTURES:
        raise UsageError(f"--sheet {sheet}: not a picture; use a name that ends in {', '.join(PICTURES)}")
    if redraw and not draw:
        raise UsageError("--redraw adds a photo to --draw; give --draw too")
    if draw and (accept or sheet is not None):
        raise UsageError("--draw cannot be combined with --accept or --sheet; run them as separate commands")

    from manitwin.cli.progress import RunDisplay
    from manitwin.dataset.review.cutouts import confirm, doubted_photos, write_sheets
    from manitwin.dataset.review.plan import require_annotator
    from manitwin.formats.printable import printable_line
    from manitwin.twin.dataset_root import DatasetRoot

    root, name = DatasetRoot(dataset), require_annotator(annotator)
    if draw:
        from manitwin.dataset.review.outlines import OutlineSession

        raise typer.Exit(_serve_and_build(dataset, OutlineSession(root, name, redraw or ()), host, port, browser, jobs))
    photos = doubted_photos(root)
    if sheet is not None:
        for written in write_sheets(root, photos, sheet):
            out_console.print(f"{written}")
    if not accept:
        for each in photos:
            out_console.print(f"{each.twin_id}  {printable_line(each.detail, max_characters=400)}")
        out_console.print(f"{len(photos)} cut-outs are doubted")
        raise typer.Exit(0)
    with RunDisplay("photos", dataset) as watched:
        confirmed, run = confirm(root, accept, name, jobs=jobs, **watched.callbacks)
    raise typer.Exit(_print_run_outcome(dataset, run, f"{len(confirmed)} cut-outs are confirmed by {name}"))


def _serve_and_build(
    dataset: str, session: OutlineSession, host: str, port: int, browser: bool, jobs: int | None
) -> int:
    """Serve the pages until interrupted, then build what was drawn; returns the exit status."""
    import webbrowser

    from manitwin.cli.commands.view import has_screen, print_unlogged_link, stop_server_on_interrupt, warn_if_open
    from manitwin.cli.progress import RunDisplay
    from manitwin.errors import UsageError
    from manitwin.web.serve import draw_outlines

    if not session.photos:
        raise UsageError(f"{dataset}: no photo was rejected for its cut-out; --redraw ID shows another photo")
    remark = f"{len(session.photos)} photos; stop with Ctrl-C to build what was drawn"
    with stop_server_on_interrupt() as ends_with:

        def ready(server: PageServer) -> None:
            ends_with(server)
            warn_if_open(server)
            print_unlogged_link(server.link(), remark)
            if browser and has_screen():
                webbrowser.open(server.link())

        draw_outlines(session, host, port, ready, lambda link: print_unlogged_link(link, remark))
    if not session.outlined_keys and not session.restated_twins:
        out_console.print("stopped; nothing was drawn")
        return 0
    with RunDisplay("photos", dataset) as watched:
        run = session.build(jobs=jobs, **watched.callbacks)
    said = f", {len(session.restated_twins)} things are named or measured," if session.restated_twins else ""
    begun = f"{len(session.outlined_keys)} outlines are drawn{said} by {session.annotator}"
    return _print_run_outcome(dataset, run, begun, "; `--draw --redraw ID` shows one of them again")


def _print_run_outcome(dataset: str, run: RunReport, begun: str, remedy: str = "") -> int:
    """Print what became of the photos, and the ``remedy`` where some are not accepted; returns the exit status."""
    counts = run.counts_of_given
    told = ", ".join(f"{counts[state]} {state}" for state in ("accepted", "rejected", "failed") if counts.get(state))
    out_console.print(f"{begun}: {told}")
    unfinished = bool(run.open or counts.get("failed"))
    if unfinished or counts.get("rejected"):
        print_error(f"`manitwin status {dataset}` says why not all are accepted{remedy}")
    return 4 if unfinished else 3 if counts.get("rejected") else 0
