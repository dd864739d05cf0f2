"""``manitwin segmentation``: drawn scenes as data sets on which segmenters and pose estimators train."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import out_console


def segmentation(
    scenes: Annotated[
        Path,
        options.existing_path_argument(
            "Scenes that `manitwin layout --pictures` drew, or one of them.", "SCENES", "a folder of drawn scenes"
        ),
    ],
    out: Annotated[Path, options.output_folder("The folder to write; it must be new or empty.")],
    form: Annotated[
        str,
        option_values.SEGMENTATION_FORMATS.option(
            "--format", help="Format: coco, coco-panoptic, cityscapes, bop or pointcloud."
        ),
    ],
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
        float, typer.Option("--val", help="Fraction of scenes in the val split.", min=0, max=1)
    ] = 0.1,
    points: Annotated[
        int,
        typer.Option(
            help="Maximum number of points in the cloud of a scene.", callback=option_values.count_callback("--points")
        ),
    ] = 100_000,
) -> None:
    """Write instance, class and part segmentation of drawn scenes: masks, panoptic pictures, poses, point clouds."""
    from manitwin.scenes.perception.segmentation import write_segmentation

    done = write_segmentation(scenes, out, form, dataset=dataset, validation_share=validation_share, points=points)
    out_console.print(
        f"{done.scenes:,} scenes, {done.pictures:,} pictures, {done.categories:,} categories,"
        f" {done.part_kinds:,} kinds of parts: {done.files:,} files in {out}"
    )
