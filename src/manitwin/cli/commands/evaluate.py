"""``manitwin evaluate``: a data set against truth that somebody wrote down."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import choices, options
from manitwin.cli.console import out_console
from manitwin.cli.documents import Json, print_document


def evaluate(
    what: Annotated[str, choices.EVALUATIONS.argument(help="annotations.", metavar="WHAT")],
    dataset: Annotated[
        str, options.existing("A data set, or a folder of twins.", "DATASET", "a data set, or a folder of twins")
    ],
    labels: Annotated[
        Path,
        typer.Option(
            "--labels",
            help="Truth labels, a row an object (docs/evaluation.md).",
            metavar="LABELS.csv",
            callback=choices.must_exist("a CSV file of labels"),
        ),
    ],
    json: Json = False,
) -> None:
    """Score annotations against labels: category, words, functional points, physics and grasp points, with intervals."""
    from manitwin.cli.documents import annotations_document
    from manitwin.dataset.evaluation.annotations import evaluate_annotations

    report = evaluate_annotations(dataset, labels)
    for line in report.lines():
        out_console.print(line)
    if json:
        print_document(annotations_document(report))
