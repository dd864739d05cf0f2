"""``manitwin affordances``: maps of holding and of use on the twins' surfaces, and their parts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import out_console

if TYPE_CHECKING:
    from manitwin.dataset.affordances.maps import SurfaceMaps


def affordances(
    dataset: Annotated[
        str,
        options.existing_path_argument(
            "A data set, or a folder of twins.", "DATASET", "a data set, or a folder of twins"
        ),
    ],
    out: Annotated[Path, options.output_folder("The folder to write; it must be new or empty.")],
    points: Annotated[
        int,
        typer.Option(
            help="Number of points on the surface of a twin.",
            callback=option_values.count_callback("--points", 100_000),
        ),
    ] = 2048,
    trials: Annotated[
        int,
        typer.Option(
            help="Number of grasps to try for the grasp map.", callback=option_values.count_callback("--trials", 10_000)
        ),
    ] = 200,
    seed: Annotated[int, typer.Option(help="Random seed.", min=0, max=2**63 - 1)] = 0,
    gripper: options.OwnGrippers = None,
) -> None:
    """Write affordance maps on the surfaces of twins: where to grasp them, where to grasp them for use, and where they act."""
    from manitwin.dataset.affordances.write import write_affordances
    from manitwin.robots.grippers.gripper import load_gripper

    grippers = [load_gripper(name) for name in gripper or ()]
    done = write_affordances(dataset, out, points=points, trials=trials, seed=seed, grippers=grippers, on_twin=_say)
    for identity, reason in done.left_out.items():
        out_console.print(f"left out: {reason if identity in reason else f'{identity}: {reason}'}")
    line = f"{done.twins:,} twins in {out}: {done.with_grasp_map:,} with a grasp map, {done.with_parts:,} with parts"
    if done.median_similarity is not None and done.median_area_under_curve is not None:
        agreement = f"SIM {done.median_similarity:.2f}, AUC {done.median_area_under_curve:.2f}"
        line += f"; two halves of the contacts agree, in the median, with {agreement}"
    out_console.print(line)
    raise typer.Exit(3 if done.left_out else 0)


def _say(maps: SurfaceMaps) -> None:
    out_console.print(f"{maps.twin.record.twin_id} {maps.twin.record.name}: {maps.held} of {maps.tried} grasps held")
