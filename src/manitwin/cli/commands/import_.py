"""``manitwin import``: assets of other tools as inputs of a build, with all that is annotated."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import err_console, out_console, print_error
from manitwin.cli.output_file import write_output

if TYPE_CHECKING:
    from collections.abc import Sequence

    from manitwin.assets.importers.importer import Imported


def import_(
    paths: Annotated[
        list[Path],
        options.existing_path_argument(
            "Assets: files, folders, or folders of them.", "PATH...", "an asset's file or folder, or a folder of assets"
        ),
    ],
    out: Annotated[Path, options.output_folder("The folder to write imported assets into.")],
    format: Annotated[
        str,
        option_values.IMPORT_FORMATS.option(
            "--from",
            help="Format: auto, robotwin, manitwin100k, embodiedgen, urdf, mjcf, sdf, usd, gso or twin.",
            metavar="FORMAT",
        ),
    ] = "auto",
    lock_joints: Annotated[
        bool,
        typer.Option(
            "--lock-joints",
            help="Import an articulated asset (URDF, MJCF, SDF, USD) as one rigid body in its default pose.",
        ),
    ] = False,
    each_object: Annotated[
        bool,
        typer.Option("--each-object", help="Import every free body of a scene (MJCF), not only the first."),
    ] = False,
    root: Annotated[
        Path | None,
        typer.Option(
            help="Read no files above this folder; default: the repository, package or folder of the asset.",
            metavar="FOLDER",
            callback=option_values.existing_path_callback("a folder that the assets lie in"),
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            help="Also write a JSON report of report of what was kept and dropped of each asset, and why.",
            metavar="FILE",
        ),
    ] = None,
) -> None:
    """Import assets of other tools, keep their annotations, and report what is missing."""

    from manitwin.assets.importers.importer import import_assets, kept_properties

    done = there = same = failed = 0
    first: dict[str, Path] = {}
    every = []
    wanted = {"lock_joints": lock_joints, "each_object": each_object, "root": root}
    taken = import_assets(paths, out, format=format, **wanted)  # type: ignore[arg-type]
    for imported in taken:
        every.append(imported)
        if imported.record is None or imported.folder is None:
            failed += 1
            named = str(imported.error).startswith(f"{imported.path}: ")
            print_error(str(imported.error) if named else f"{imported.path}: {imported.error}")
            continue
        if imported.there_already and imported.folder.name in first:
            same += 1
            out_console.print(
                f"{imported.folder.name}: {imported.path} is a duplicate of {first[imported.folder.name]}"
            )
            continue
        first[imported.folder.name] = imported.path
        if imported.there_already:
            there += 1
            out_console.print(f"{imported.folder.name}: already imported, left unchanged")
            continue
        done += 1
        record = imported.record
        kept = ", ".join(kept_properties(record)) or "the mesh only"
        missing = f"; missing {', '.join(record.missing)}" if record.missing else ""
        out_console.print(f"{imported.folder.name}: {record.format}; kept {kept}{missing}")
        for reason in record.dropped:
            out_console.print(f"  dropped {reason}")
        for remark in record.remarks:
            out_console.print(f"  {remark}")
    if report is not None:
        _write_report(every, report)
    before = (f", {there} already imported" if there else "") + (f", {same} duplicate" if same else "")
    then = f"; manitwin build {out} -o TWINS adds what is missing" if done or there else ""
    out_console.print(f"{done} imported{before}, {failed} not{then}")
    if any("moves by itself" in remark for each in every if each.record is not None for remark in each.record.remarks):
        out_console.print("a scene has further free bodies: --each-object imports all of them")
    raise typer.Exit(3 if failed else 0)


def _write_report(every: Sequence[Imported], file: Path) -> None:
    from manitwin.assets.importers.report import report_of

    write_output(file, report_of(every))
    err_console.print(f"{file}: report of what was kept and dropped of each asset")
