"""Scenes as MJCF and USD: what ``manitwin export`` does with what ``manitwin layout`` wrote."""

from __future__ import annotations

from pathlib import Path

from manitwin.cli.console import out_console


def scenes_among(given: list[str]) -> list[Path]:
    """Return the files of the scenes that are given; none where twins are. Raises UsageError where both are given."""
    from manitwin.errors import UsageError
    from manitwin.scenes.scene_files import scene_files

    by_place = {each: scene_files(Path(each)) for each in given}
    found = [file for files in by_place.values() for file in files]
    others = [each for each, files in by_place.items() if not files]
    if found and others:
        raise UsageError(f"{others[0]}: no scene, and {given[0]} is one; export twins and scenes apart")
    return found


def export_scenes(files: list[Path], out: Path, to: str) -> None:
    """Write ``OUT/<scene>/<format>/`` of every scene; raises UsageError for a format that scenes have not, ExportError."""
    from manitwin.api import export_scene

    for file in files:
        written = export_scene(file, [name.strip() for name in to.split(",")], out)
        out_console.print(f"{file.parent.name}: {', '.join(written)}", markup=False)
    out_console.print(f"{len(files):,} scenes exported to {out}", markup=False)
