"""``manitwin export``: twins in the files of simulators and graspers."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import err_console, out_console, print_error, print_layout_notice
from manitwin.formats.plurals import counted

if TYPE_CHECKING:
    from manitwin.assets.writers.exporter import TwinContent


def export(
    twins: Annotated[
        list[str],
        options.existing_path_argument(
            "Twin folders, folders of twins, data sets (a folder or URL); or scenes of `manitwin layout`.",
            "TWIN|SCENE",
            "a folder that manitwin has built",
        ),
    ],
    out: Annotated[Path, options.output_folder("The folder to write OUT/<twin>/<format>/ into.")],
    to: Annotated[
        str, option_values.EXPORT_FORMATS.option(help="Formats separated by commas (mjcf,urdf,sdf,usd,...), or all.")
    ] = "all",
    license_allow: Annotated[
        str | None,
        typer.Option(
            help="Licences to export, separated by commas (CC-BY-4.0,CC0-1.0); default: any, including 'unknown'."
        ),
    ] = None,
) -> None:
    """Export twins as MJCF, URDF, SDF, USD, GLB or for RoboTwin, ManiSkill, Isaac Lab, graspers; scenes as MJCF, SDF, USD."""
    from manitwin.assets.writers.licenses import allowed_licenses
    from manitwin.assets.writers.registry import chosen_formats
    from manitwin.errors import UsageError

    if scenes := scenes_among(twins):
        if license_allow is not None:
            raise UsageError(
                "--license-allow applies to twins, not scenes; to filter by licence, export the twins of the scene"
            )
        export_scenes(scenes, out, to)
        return
    formats = chosen_formats(to.split(","))
    allowed = None if license_allow is None else allowed_licenses(license_allow.split(","))
    ids: dict[str, str] = {}
    done = [_export(folder, formats, out, allowed, ids) for folder in twin_folders(twins)]
    refused = done.count(False)
    line = f"{counted(done.count(True), 'twins')} exported to {out}"
    out_console.print(f"{line}, {refused:,} refused" if refused else line)
    raise typer.Exit(3 if refused else 0)


def scenes_among(given: list[str]) -> list[Path]:
    """Return the files of the scenes that are given; none where twins are. Raises UsageError where both are given."""
    from manitwin.errors import UsageError
    from manitwin.scenes.scene_files import scene_files

    by_place = {each: scene_files(Path(each)) for each in given}
    found = [file for files in by_place.values() for file in files]
    others = [each for each, files in by_place.items() if not files]
    if found and others:
        raise UsageError(
            f"{others[0]}: not a scene, but {given[0]} is one; export twins and scenes in separate commands"
        )
    return found


def export_scenes(files: list[Path], out: Path, to: str) -> None:
    """Write ``OUT/<scene>/<format>/`` of every scene; raises UsageError for a format that scenes have not, ExportError."""
    from manitwin.api import export_scene, load_scene

    for file in files:
        scene = load_scene(file)
        written = export_scene(scene, [name.strip() for name in to.split(",")], out)
        out_console.print(f"{file.parent.name}: {', '.join(written)}")
        if scene.stale is not None:
            err_console.print(
                f"{file}: {scene.stale}: objects may fall or overlap; sample the layouts again into a new folder"
            )
    out_console.print(f"{counted(len(files), 'scenes')} exported to {out}")


def twin_folders(given: list[str]) -> Iterator[Path]:
    """Yield the folders of the twins that are meant, each once; those of a URL as copies that last until the next.

    Raises UsageError for what is not there or has no twins.
    """
    from manitwin.errors import UsageError
    from manitwin.twin.dataset_root import DatasetRoot

    seen = set[Path]()
    for each in given:
        root, found = DatasetRoot(each), False
        print_layout_notice(root)
        for folder in _local_twins(root.local) if root.local is not None else ():
            found = True
            if folder.resolve() not in seen:
                seen.add(folder.resolve())
                yield folder
        for twin_id in root.twin_ids() if root.local is None else ():
            found = True
            with tempfile.TemporaryDirectory() as copy:
                yield root.fetch_folder(root.twin_name(twin_id), Path(copy) / twin_id)
        if not found:
            raise UsageError(f"{each}: no twin.json in it or below it; give a folder that manitwin has built")


def _local_twins(folder: Path) -> Iterator[Path]:
    """Yield the folders at or below one that hold a twin, sorted; hidden ones are work in progress."""
    from manitwin.twin.store import RECORD

    for path, folders, files in os.walk(folder):
        folders[:] = [] if RECORD in files else sorted(name for name in folders if not name.startswith("."))
        if RECORD in files:
            yield Path(path)


def _export(
    folder: Path, formats: tuple[str, ...], out: Path, allowed: frozenset[str] | None, ids: dict[str, str]
) -> bool:
    """Write one twin in all formats and say so, or say why not; tells whether all went out."""
    from manitwin.assets.writers.write import export_twin
    from manitwin.errors import ExportError, TwinError

    try:
        content = _content(folder, allowed)
        if ids.setdefault(content.name, content.record.twin_id) != content.record.twin_id:
            raise ExportError(f"{folder}: another twin has the same name {content.name}; export it to another folder")
    except (ExportError, TwinError) as error:
        print_error(str(error))
        return False
    written: list[str] = []
    locked: list[str] = []
    for name in formats:
        try:
            export_twin(content, name, out, on_locked=locked.append)
            written.append(name)
        except ExportError as error:
            print_error(f"{name}: {error}")
    out_console.print(f"{content.name}: {', '.join(written) or 'nothing'}")
    if locked:
        out_console.print(
            f"  exported without joints, as one rigid body, to {', '.join(locked)}; mjcf, urdf, sdf and usd keep the joints"
        )
    return len(written) == len(formats)


def _content(folder: Path, allowed: frozenset[str] | None) -> TwinContent:
    from manitwin.assets.writers.exporter import TwinContent
    from manitwin.assets.writers.licenses import check_license
    from manitwin.twin.loaded_twin import Twin

    twin = Twin(folder)
    if twin.record.rejection is None:
        check_license(twin.record, allowed)  # before its meshes are read; a rejected one says first that it is
    return TwinContent.of(twin)
