"""``manitwin catalog``: pictures, point clouds, captions and categories of twins, with splits."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import options
from manitwin.cli.console import out_console


def catalog(
    dataset: Annotated[
        str, options.existing_path_argument("A data set with an index.", "DATASET", "the folder of a data set")
    ],
    out: Annotated[Path, options.output_folder("The folder to write; it must be new or empty.")],
    size_px: Annotated[
        int, typer.Option("--size", help="Width and height of the pictures, in pixels.", min=32, max=2048)
    ] = 224,
    seed: Annotated[int, typer.Option(help="Random seed of the points.", min=0, max=2**63 - 1)] = 0,
) -> None:
    """Write multi-view pictures, point clouds, captions and categories of twins, split by shape and source."""
    from manitwin.dataset.catalog.write import write_catalog

    done = write_catalog(dataset, out, size_px=size_px, seed=seed)
    for reason in done.left_out.values():
        out_console.print(f"left out: {reason}")
    splits = ", ".join(f"{count:,} {name}" for name, count in done.twins.items())
    out_console.print(
        f"{sum(done.twins.values()):,} twins ({splits}) of {done.categories:,} categories, {done.pictures:,} pictures in {out};"
        f" {done.joined_groups:,} groups of near-duplicates stay together"
    )
    raise typer.Exit(3 if done.left_out else 0)
