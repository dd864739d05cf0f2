"""``manitwin import``: assets of other tools as inputs of a build, with all that is annotated."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import choices, options
from manitwin.cli.console import err_console, out_console, print_error
from manitwin.cli.output_file import write_output

if TYPE_CHECKING:
    from collections.abc import Sequence

    from manitwin.assets.importers.importer import Imported


def import_(
    paths: Annotated[
        list[Path],
        options.existing(
            "Assets: files, folders, or folders of them.", "PATH...", "an asset's file or folder, or a folder of assets"
        ),
    ],
    out: Annotated[Path, options.output_folder("The folder to write imported assets into.")],
    format: Annotated[
        str,
        choices.IMPORT_FORMATS.option(
            "--from",
            help="auto, robotwin, manitwin100k, embodiedgen, urdf, mjcf, sdf, usd, gso or twin.",
            metavar="FORMAT",
        ),
    ] = "auto",
    lock_joints: Annotated[
        bool,
        typer.Option(
            "--lock-joints",
            help="Take what moves by joints (URDF, MJCF, SDF, USD) as one rigid body, as the file stands.",
        ),
    ] = False,
    each_object: Annotated[
        bool,
        typer.Option(
            "--each-object", help="Take every object of a scene (MJCF) that is free to move, not its first alone."
        ),
    ] = False,
    root: Annotated[
        Path | None,
        typer.Option(
            help="The folder above which nothing is read; else an asset's repository, package or own folder.",
            metavar="FOLDER",
            callback=choices.must_exist("a folder that the assets lie in"),
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(help="Also write as JSON what was kept and dropped of each asset, and why.", metavar="FILE"),
    ] = None,
) -> None:
    """Take assets of other tools over, keep what is annotated, and say what is missing."""

    from manitwin.assets.importers.importer import import_assets, kept_words

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
                f"{imported.folder.name}: {imported.path} is the same again as {first[imported.folder.name]}"
            )
            continue
        first[imported.folder.name] = imported.path
        if imported.there_already:
            there += 1
            out_console.print(f"{imported.folder.name}: imported before, left as it is")
            continue
        done += 1
        record = imported.record
        kept = ", ".join(kept_words(record)) or "the mesh only"
        missing = f"; missing {', '.join(record.missing)}" if record.missing else ""
        out_console.print(f"{imported.folder.name}: {record.format}; kept {kept}{missing}")
        for reason in record.dropped:
            out_console.print(f"  dropped {reason}")
        for remark in record.remarks:
            out_console.print(f"  {remark}")
    if report is not None:
        _write_report(every, report)
    before = (f", {there} imported before" if there else "") + (f", {same} the same again" if same else "")
    then = f"; manitwin build {out} -o TWINS fills in what is missing" if done or there else ""
    out_console.print(f"{done} imported{before}, {failed} not{then}")
    if any("moves by itself" in remark for each in every if each.record is not None for remark in each.record.remarks):
        out_console.print("a scene has more objects that move: --each-object takes them all")
    raise typer.Exit(3 if failed else 0)


def _write_report(every: Sequence[Imported], file: Path) -> None:
    from manitwin.assets.importers.report import report_of

    write_output(file, report_of(every))
    err_console.print(f"{file}: what was kept and dropped of each asset")
