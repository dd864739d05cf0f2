"""``manitwin evaluate``: a data set beside the paper's tables, and against truth that somebody wrote down."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import err_console, out_console
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    from manitwin.dataset.evaluation.tables import EvaluationReport
    from manitwin.models.embedders.clip import ClipFolder
    from manitwin.models.embedders.clip_endpoint import ClipEndpoint

OPTIONS = {"annotations": {"--labels"}, "generation": {"--clip", "--ulip", "--out"}, "grasps": {"--out"}}
"""What each evaluation takes besides the data set."""


def _model(help: str) -> Any:
    return typer.Option(
        help=help, metavar="FOLDER", callback=option_values.existing_path_callback("a model's folder of ONNX files")
    )


def evaluate(
    what: Annotated[
        str,
        option_values.EVALUATIONS.argument(help="What to evaluate: annotations, generation or grasps.", metavar="WHAT"),
    ],
    dataset: Annotated[
        str,
        options.existing_path_argument(
            "A data set, or a folder of twins.", "DATASET", "a data set, or a folder of twins"
        ),
    ],
    labels: Annotated[
        Path | None,
        typer.Option(
            "--labels",
            help="annotations: ground-truth labels, one row per object (docs/evaluation.md).",
            metavar="LABELS.csv",
            callback=option_values.existing_path_callback("a CSV file of labels"),
        ),
    ] = None,
    clip: Annotated[
        str | None,
        typer.Option(
            help="generation: CLIP model for CLIP(N-I/T) and CLIP(I-I/T): a folder of ONNX files, or MODEL@http://HOST:PORT.",
            metavar="FOLDER|SERVER",
            callback=option_values.existing_path_callback("a model's folder of ONNX files, or MODEL@http://HOST:PORT"),
        ),
    ] = None,
    ulip: Annotated[Path | None, _model("generation: ULIP model with a point cloud encoder, for ULIP-I/T.")] = None,
    out: Annotated[Path | None, options.new_folder("New folder for tables (CSV, Parquet) and a page.")] = None,
    seed: Annotated[int, typer.Option(help="Random seed of the shuffled pairs.", min=0, max=options.LARGEST_SEED)] = 0,
    json: Json = False,
) -> None:
    """Print the paper's tables beside those of a data set, or score its annotations against labels, with intervals."""
    from manitwin.errors import UsageError

    given = {"--labels": labels, "--clip": clip, "--ulip": ulip, "--out": out}
    unused = [name for name, value in given.items() if value is not None and name not in OPTIONS[what]]
    if unused:
        raise UsageError(
            f"{', '.join(unused)}: not an option of evaluate {what}, which takes {', '.join(sorted(OPTIONS[what]))}"
        )
    if what == "annotations":
        if labels is None:
            raise UsageError("--labels: missing; give a CSV file of labels (docs/evaluation.md)")
        _annotations(dataset, labels, json)
        return
    report = _report(what, dataset, clip, ulip, seed)
    if out is not None:
        from manitwin.dataset.evaluation.tables import write_evaluation

        write_evaluation(out, report)
    if json:
        print_document(report.document())
        return
    for line in report.lines():
        out_console.print(line, markup=False, soft_wrap=True)


def _annotations(dataset: str, labels: Path, json: bool) -> None:
    from manitwin.cli.documents import annotations_document
    from manitwin.dataset.evaluation.annotations import evaluate_annotations

    report = evaluate_annotations(dataset, labels)
    for line in report.lines():
        out_console.print(line)
    if json:
        print_document(annotations_document(report))


def _clip(said: str) -> ClipFolder | ClipEndpoint:
    from manitwin.models.embedders.clip import ClipFolder

    if "://" not in said:
        return ClipFolder(Path(said))
    from manitwin.config import ServicesConfig
    from manitwin.models.embedders.clip_endpoint import ClipEndpoint

    return ClipEndpoint(said, ServicesConfig())


def _report(what: str, dataset: str, clip: str | None, ulip: Path | None, seed: int) -> EvaluationReport:
    if what == "grasps":
        from manitwin.dataset.evaluation.grasps import evaluate_grasps

        return evaluate_grasps(dataset)
    from manitwin.dataset.evaluation.generation import evaluate_generation
    from manitwin.dataset.evaluation.input_likeness import Models
    from manitwin.models.embedders.clip import ClipFolder

    models = Models(None if clip is None else _clip(clip), None if ulip is None else ClipFolder(ulip, points=True))
    return evaluate_generation(
        dataset, models, seed=seed, on_twin=lambda twin_id: err_console.print(f"{twin_id}: compared with its input")
    )
