"""``manitwin layout``: scenes of several twins."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import option_values, options
from manitwin.cli.causes import print_causes, read_causes
from manitwin.cli.console import err_console, out_console, print_error
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    from manitwin.scenes.layouts.layouts_run import LayoutTotals


@options.with_options(options.RUN, before="json")
def layout(
    dataset: Annotated[
        str,
        options.existing_path_argument(
            "A data set, or a folder of twins.", "DATASET", "a data set, or the folder that manitwin build wrote"
        ),
    ],
    out: Annotated[str, options.output_folder("The folder to write scenes into.")],
    count: Annotated[
        int, typer.Option("-n", help="Number of layouts.", callback=option_values.count_callback("-n"))
    ] = 100,
    objects: Annotated[
        str | None, typer.Option(help="Number of objects per layout: LOW..HIGH.", metavar="LOW..HIGH")
    ] = None,
    surface: Annotated[str | None, option_values.SURFACES.option(help="Surface: table, shelf or tray.")] = None,
    clutter: Annotated[
        str | None, option_values.CLUTTER.option(help="Density of the objects: sparse, medium or dense.")
    ] = None,
    include: Annotated[
        list[str] | None,
        typer.Option(help="Category that every layout must contain; may be repeated.", metavar="CATEGORY"),
    ] = None,
    stacked: Annotated[
        int | None, typer.Option(help="Number of objects that stand on another object.", min=0, max=200)
    ] = None,
    contained: Annotated[
        int | None, typer.Option(help="Number of objects that lie in a container.", min=0, max=200)
    ] = None,
    upright: Annotated[
        bool, typer.Option("--upright", help="Place objects upright if they have a stable upright placement.")
    ] = False,
    robot: Annotated[
        str | None, option_values.ROBOTS.option(help="Place objects within the workspace of this robot.")
    ] = None,
    pictures: Annotated[
        bool,
        typer.Option(
            "--pictures", help="Also render each layout (colour, depth, normals, instance ids) and a contact sheet."
        ),
    ] = False,
    sheet: Annotated[bool, typer.Option("--sheet", help="File for a contact sheet of the first 48 scenes.")] = False,
    json: Json = False,
    **run: Any,
) -> None:
    """Sample scenes of twins at rest on a table, a shelf or a tray; rerun the command to resume."""
    given = {
        "objects": None if objects is None else _range(objects), "surface": surface, "clutter": clutter, "robot": robot,
        "include": tuple(include) if include else None, "stacked": stacked, "contained": contained,
        "upright": upright or None,
    }  # fmt: skip
    from manitwin.scenes.settings import LayoutsConfig

    chosen = {name: value for name, value in given.items() if value is not None}
    settings = options.read_settings(LayoutsConfig, run, {"pictures": pictures or None, "layout": chosen})
    from manitwin.api import make_layouts
    from manitwin.cli.progress import RunDisplay
    from manitwin.scenes.layouts.layouts_run import CONTACT_SHEET, layout_totals, twins_without_upright
    from manitwin.scenes.layouts.pool import cached_pool
    from manitwin.twin.dataset_root import DatasetRoot

    sheet = sheet or settings.pictures or DatasetRoot(out).exists(CONTACT_SHEET)  # one that is there is kept up to date
    if sheet:
        from manitwin.render.device import require_renderer

        require_renderer()
    with RunDisplay("layouts", out) as watched:
        report = make_layouts(
            dataset, out, count, config=settings, **options.executor_settings(run), **watched.callbacks
        )
    for remark in report.remarks:
        err_console.print(remark)
    totals = layout_totals(out)
    if settings.layout.upright and (lying := twins_without_upright(dataset)):
        out_console.print(f"twins without an upright placement, placed in another resting pose: {len(lying)}")
    if said := cached_pool(DatasetRoot(dataset).absolute()).joints_remark:
        out_console.print(said)
    _print_totals(totals)
    if sheet and totals.accepted:
        from manitwin.scenes.layouts.scenes_sheet import write_contact_sheet

        shown = write_contact_sheet(dataset, out)
        out_console.print(f"{shown} of {totals.accepted} scenes in {out}/{CONTACT_SHEET}")
    if report.stopped:
        print_error(f"stopped: {report.stopped}")
    print_causes(out)
    if json:
        from manitwin.cli.documents import layouts_document

        print_document(layouts_document(report, out, read_causes(out), totals))
    raise typer.Exit(report.exit_code)


def _print_totals(totals: LayoutTotals) -> None:
    ended = totals.accepted + sum(totals.rejected.values())
    why = "".join(f", {n} {reason}" for reason, n in totals.rejected.items())
    out_console.print(f"{totals.accepted} of {ended} layouts accepted ({totals.acceptance:.1%}){why}")
    out_console.print(
        f"{totals.objects} objects; {totals.repaired} layouts were repaired; as they settled, objects moved at most "
        f"{1000 * totals.max_moved_m:.1f} mm and turned {degrees(totals.max_turned_rad):.1f} degrees; they overlap by at most "
        f"{1000 * totals.max_penetration_m:.2f} mm; {totals.cpu_seconds / max(1, ended):.2f} CPU-s each",
    )


def _range(text: str) -> tuple[int, int]:
    from manitwin.errors import UsageError
    from manitwin.scenes.settings import MOST_OBJECTS

    low, _, high = text.partition("..")
    try:
        least, most = int(low), int(high or low)
    except ValueError:
        raise UsageError(f"--objects {text}: give LOW..HIGH, such as 3..12") from None
    if not 1 <= least <= most <= MOST_OBJECTS:
        raise UsageError(f"--objects {text}: give LOW..HIGH with 1 <= LOW <= HIGH <= {MOST_OBJECTS}, such as 3..12")
    return least, most
