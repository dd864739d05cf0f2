"""Scenes as MJCF and USD: what ``manitwin export`` does with what ``manitwin layout`` wrote."""

from __future__ import annotations

from pathlib import Path

from manitwin.cli.console import out_console

SCENE_FORMATS = ("mjcf", "usd")


def scene_files(given: list[str]) -> list[Path]:
    """Return the scene files that are meant: a file, a scene's folder, or all of a run; none where twins are given.

    Raises UsageError where scenes and twins are given together.
    """
    from manitwin.errors import UsageError
    from manitwin.scenes.scene import SCENE
    from manitwin.scenes.scene_folders import SCENES

    found: list[Path] = []
    others: list[str] = []
    for each in given:
        path = Path(each)
        if path.is_file() and path.name == SCENE:
            found.append(path)
        elif (path / SCENE).is_file():
            found.append(path / SCENE)
        elif scenes := sorted((path / SCENES).glob(f"*/*/{SCENE}")):
            found += scenes
        else:
            others.append(each)
    if found and others:
        raise UsageError(f"{others[0]}: no scene, and {given[0]} is one; export twins and scenes apart")
    return found


def export_scenes(files: list[Path], out: Path, to: str) -> None:
    """Write ``OUT/<scene>/<format>/`` of every scene; raises UsageError for a format that scenes have not, ExportError."""
    from manitwin.api import load_scene
    from manitwin.assets.writers.write import write_exported
    from manitwin.errors import UsageError, choose_from
    from manitwin.scenes.layouts.export_mjcf import export_mjcf
    from manitwin.scenes.layouts.export_usd import export_usd

    names = SCENE_FORMATS if to == "all" else tuple(name.strip() for name in to.split(","))
    for name in names:
        if name not in SCENE_FORMATS:
            raise UsageError(choose_from("format of a scene", name, SCENE_FORMATS))
    exporters = {"mjcf": export_mjcf, "usd": export_usd}
    for file in files:
        scene = load_scene(file)
        for name in names:
            write_exported(exporters[name](scene), out / scene.record.scene_id / name)
        out_console.print(f"{scene.record.scene_id}: {', '.join(names)}", markup=False)
    out_console.print(f"{len(files):,} scenes exported to {out}", markup=False)
