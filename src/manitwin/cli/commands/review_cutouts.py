"""``manitwin review cutouts``: cut-outs of rejected photos are looked at, and built where a person finds them right."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import options
from manitwin.cli.commands.review import Dataset
from manitwin.cli.console import out_console, print_error

PICTURES = (".png", ".webp", ".jpg")


def review_cutouts(
    dataset: Dataset,
    sheet: Annotated[
        Path | None,
        typer.Option(
            help="Draw them here, side by side; after 48 on a further sheet.", metavar="FILE.png", dir_okay=False
        ),
    ] = None,
    accept: Annotated[
        list[str] | None,
        typer.Option(
            help="A photo whose cut-out you have looked at and found right: it is built; may be given again.",
            metavar="ID",
        ),
    ] = None,
    annotator: Annotated[str, typer.Option(help="Who has looked at them.", metavar="NAME")] = "me",
    jobs: options.Jobs = None,
) -> None:
    """List rejected photos whose cut-out was doubted, draw them, or build those that you find right."""
    from manitwin.errors import UsageError

    if sheet is not None and sheet.suffix.lower() not in PICTURES:
        raise UsageError(f"--sheet {sheet}: no picture; end it in {', '.join(PICTURES)}")

    from manitwin.cli.progress import WatchedRun
    from manitwin.dataset.review.cutouts import confirm, doubted_photos, write_sheets
    from manitwin.dataset.review.plan import require_annotator
    from manitwin.formats.printable import printable_line
    from manitwin.twin.dataset_root import DatasetRoot

    root, name = DatasetRoot(dataset), require_annotator(annotator)
    photos = doubted_photos(root)
    if sheet is not None:
        for written in write_sheets(root, photos, sheet):
            out_console.print(f"{written}")
    if not accept:
        for each in photos:
            out_console.print(f"{each.twin_id}  {printable_line(each.detail, max_characters=400)}")
        out_console.print(f"{len(photos)} cut-outs are doubted")
        raise typer.Exit(0)
    with WatchedRun("photos", dataset) as watched:
        confirmed, run = confirm(root, accept, name, jobs=jobs, **watched.callbacks)
    counts = run.counts_of_given
    told = ", ".join(f"{counts[state]} {state}" for state in ("accepted", "rejected", "failed") if counts.get(state))
    out_console.print(f"{len(confirmed)} cut-outs are confirmed by {name}: {told}")
    unfinished = bool(run.open or counts.get("failed"))
    if unfinished or counts.get("rejected"):
        print_error(f"`manitwin status {dataset}` says why not all are accepted")
    raise typer.Exit(4 if unfinished else 3 if counts.get("rejected") else 0)
