"""``manitwin vqa``: questions about drawn scenes with computed answers, for vision-language models."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import out_console


def vqa(
    scenes: Annotated[
        Path,
        options.existing_path_argument(
            "Scenes that `manitwin layout --pictures` drew, or one of them.", "SCENES", "a folder of drawn scenes"
        ),
    ],
    out: Annotated[Path, options.output_folder("The folder to write; it must be new or empty.")],
    form: Annotated[
        str,
        option_values.VQA_FORMATS.option("--format", help="Format: llava (LLaVA and ShareGPT), parquet or webdataset."),
    ] = "llava",
    per_scene: Annotated[
        int,
        typer.Option(
            help="Maximum number of questions per scene.", callback=option_values.count_callback("--per-scene")
        ),
    ] = 80,
    points: Annotated[
        str,
        option_values.POINT_CONVENTIONS.option(
            "--points", help="Coordinate convention of points: unit, robopoint, roborefer, pixel or thousand."
        ),
    ] = "unit",
    dataset: Annotated[
        Path | None,
        typer.Option(
            "--twins",
            help="Data set of the twins; default: the one recorded in the scenes.",
            metavar="DATASET",
            callback=option_values.existing_path_callback("the data set that the scenes were sampled from"),
        ),
    ] = None,
    validation_share: Annotated[
        float,
        typer.Option(
            "--val", help="Fraction of scenes in the val split, whose questions are worded differently.", min=0, max=1
        ),
    ] = 0.1,
    seed: Annotated[int, typer.Option(help="Random seed.", min=0, max=options.LARGEST_SEED)] = 7,
    vlm: Annotated[
        str,
        option_values.PROPOSERS.option(
            help="Model that paraphrases the questions: openai:MODEL@URL, anthropic:MODEL, replay:FILE, or none.",
            metavar="SPEC",
        ),
    ] = "none",
) -> None:
    """Write questions about drawn scenes with computed answers and the evidence for each."""
    from manitwin.scenes.vqa.write import write_vqa

    done = write_vqa(
        scenes,
        out,
        form,
        dataset=dataset,
        per_scene=per_scene,
        points=points,
        validation_share=validation_share,
        seed=seed,
        vlm=vlm,
    )
    out_console.print(
        f"{done.questions:,} questions of {done.families} families about {done.pictures:,} pictures of {done.scenes:,}"
        f" scenes: {done.files:,} files in {out}"
    )
    if vlm != "none":
        out_console.print(
            f"{done.rephrased:,} questions in the model's words; what it gave is in {out / 'rephrasings.json'}"
        )
