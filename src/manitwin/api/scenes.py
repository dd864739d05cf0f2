"""Make scenes from the twins of a data set; find, load and export scenes."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from manitwin.api.settings import settings_of
from manitwin.errors import UsageError

if TYPE_CHECKING:
    from manitwin.engine.drive import RunOptions, RunReport
    from manitwin.scenes.loaded_scene import Scene
    from manitwin.scenes.settings import LayoutsConfig


def make_layouts(
    dataset: str | Path,
    out: str | Path,
    count: int = 100,
    *,
    config: LayoutsConfig | str | Path | None = None,
    jobs: int | None = None,
    **run: Unpack[RunOptions],
) -> RunReport:
    """Sample ``count`` scenes of twins at rest into the folder ``out``; existing scenes are kept (docs/layouts.md).

    ``config``: the settings, or a TOML file with them; if its ``pictures`` is set, each scene is rendered. ``jobs``: number of
    processes, by default one per core. ``find_scenes`` lists the accepted scenes. Raises UsageError for a data set without
    twins, for categories that it does not contain, for an ``out`` with scenes of other settings, or if another run is writing
    there.
    """
    from manitwin.scenes.layouts.layouts_run import make_layouts as make
    from manitwin.scenes.settings import LayoutsConfig

    settings = settings_of(LayoutsConfig, config, jobs)
    return make(dataset, out, count, settings, **run)


def find_scenes(place: str | Path) -> list[Path]:
    """Return the scene files at ``place``: a scene file, a scene's folder, or a folder written by ``make_layouts``.

    Raises UsageError if there are none.
    """
    from manitwin.scenes.scene_files import scene_files

    found = scene_files(Path(place))
    if not found:
        raise UsageError(f"{place}: no scene found; create scenes with `manitwin layout DATASET -o {place}`")
    return found


def load_scene(scene: str | Path, dataset: str | Path | None = None) -> Scene:
    """Load a scene by its file or folder; ``dataset`` None is the data set that it was sampled from.

    Raises UsageError if the scene cannot be read, or if its folder does not state the data set.
    """
    from manitwin.scenes.loaded_scene import Scene
    from manitwin.scenes.scene_files import dataset_of

    return Scene.read(scene, dataset_of(Path(scene)) if dataset is None else dataset)


def export_scene(scene: Scene | str | Path, to: str | Iterable[str], out: str | Path) -> dict[str, Path]:
    """Export a scene to one or more formats (``"mjcf"``, ``["sdf", "usd"]``, ``"all"``) below ``out``.

    Returns the main file of each format. An earlier export is replaced. Raises UsageError for an unknown format and for a
    missing scene or twin, and ExportError if a format cannot represent the scene.
    """
    from manitwin.assets.writers.write import write_exported
    from manitwin.errors import unknown_name_message
    from manitwin.scenes.layouts.export_mjcf import export_mjcf
    from manitwin.scenes.layouts.export_sdf import export_sdf
    from manitwin.scenes.layouts.export_usd import export_usd

    exporters = {"mjcf": export_mjcf, "sdf": export_sdf, "usd": export_usd}
    asked = [to] if isinstance(to, str) else list(to)
    names = list(exporters) if "all" in asked else asked
    for name in names:
        if name not in exporters:
            raise UsageError(unknown_name_message("format of a scene", name, exporters))
    loaded = load_scene(scene) if isinstance(scene, str | Path) else scene
    place = Path(out) / loaded.record.scene_id
    return {name: write_exported(exporters[name](loaded), place / name) for name in names}
