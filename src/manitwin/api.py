"""The functions of ``manitwin``: build twins, make scenes and episodes of them, load, export, import and count them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Unpack

from manitwin.errors import UsageError

if TYPE_CHECKING:  # what only a build needs takes 2 CPU-seconds to import
    import duckdb

    from manitwin.assets.asset import Format
    from manitwin.assets.importers.importer import Imported
    from manitwin.config import BuildConfig
    from manitwin.dataset.index.rebuild import Rebuilt
    from manitwin.dataset.statistics.report import WrittenReport
    from manitwin.engine.drive import ExecutorName, RunOptions, RunReport
    from manitwin.engine.events import OnStage
    from manitwin.episodes.collect import AttemptTotals
    from manitwin.episodes.environment.environment import TaskEnvironment
    from manitwin.episodes.environment.start_noise import StartNoise
    from manitwin.episodes.lerobot.write import LeRobotSummary
    from manitwin.episodes.retirement import Retirement
    from manitwin.episodes.settings import PicturesConfig, TasksConfig, TrajectoriesConfig
    from manitwin.episodes.tasks.tasks_run import TaskTotals
    from manitwin.pipeline.build_report import BuildReport, ItemResult
    from manitwin.pipeline.settings import Flags
    from manitwin.scenes.loaded_scene import Scene
    from manitwin.scenes.settings import LayoutsConfig
    from manitwin.twin.loaded_twin import Twin


def build(
    inputs: str | Path | Iterable[str | Path],
    out: str | Path,
    *,
    texts: Iterable[str] = (),
    name: str | None = None,
    units: str = "auto",
    up: str = "auto",
    longest_side_m: float | None = None,
    license: str | None = None,
    attribution: str | None = None,
    count: int = 1,
    views: bool = False,
    turns_deg: Sequence[float] | None = None,
    strict: bool = False,
    jobs: int | None = None,
    config: BuildConfig | str | Path | None = None,
    executor: ExecutorName = "local",
    address: str | None = None,
    on_estimate: Callable[[dict[str, float]], None] = lambda usd_by_kind: None,
    on_start: Callable[[int, int], None] = lambda items, opened: None,
    on_stage: OnStage = lambda event: None,
    on_result: Callable[[ItemResult], None] = lambda result: None,
    **flags: Unpack[Flags],
) -> BuildReport:
    """Build twins from images, meshes, folders, manifests and ``texts`` into the data set ``out``, a folder or a URL.

    Without inputs a build goes on with what is there. What was built under the same configuration and seed is not built again;
    under another one, the inputs that are given are (where none is given, all that are there), from the first stage that
    it changes.

    ``name``, ``units`` m|cm|mm|none|auto, ``up`` y|z|auto, ``longest_side_m`` (of length, width and height as it stands),
    ``license`` and ``attribution`` hold for all inputs whose manifest row does not say otherwise; of each text ``count``
    variations are made, which differ in what it leaves open. With ``views`` the inputs are photos of one thing, which becomes
    one twin; ``turns_deg`` is the camera's turn about the vertical in each, counter-clockwise seen from above. With ``strict``
    a manifest's column that nobody knows is an error. ``config`` None: what the data set was built with, else the defaults.
    ``flags`` are said on top of it: ``seed``; ``grippers``, names or .toml files, the first one's grasps are the twin's own;
    ``vlm``, ``generator`` and ``grasper`` choose backends (docs/backends.md); once services
    have charged ``max_cost_usd``, items that would cost more are left unfinished; ``record`` is a file that a VLM's answers are
    added to; ``require_agreement`` verifies only what a second engine holds too; ``second_opinion`` "sample" tries 20 of
    the held grasps there instead of all; ``quick`` leaves out second engine and robustness; ``link`` asks of things with joints,
    which are locked, for grasps that touch this link with both fingertips.
    ``executor`` is local (``jobs`` processes), ray (a cluster at ``address``), or inline, in this process.

    Raises UsageError for wrong arguments, and where another build is at work there; what happens to one item is in the report
    and never raised.
    """
    from manitwin.pipeline.settings import request_build

    defaults = {
        "name": name,
        "units": units,
        "up": up,
        "longest_side_m": longest_side_m,
        "license": license,
        "attribution": attribution,
    }
    request = request_build(
        inputs, out, texts=texts, count=count, views=views, turns_deg=turns_deg, strict=strict, jobs=jobs, config=config,
        defaults=defaults, flags=flags,
    )  # fmt: skip
    from manitwin.dataset.build import build_requested

    return build_requested(
        request, executor=executor, address=address, on_estimate=on_estimate, on_start=on_start, on_stage=on_stage,
        on_result=on_result,
    )  # fmt: skip


def load(folder: str | Path, verify: bool = False) -> Twin:
    """Load a finished twin; with ``verify``, check the digest of every file. Raises TwinError."""
    from manitwin.twin.loaded_twin import Twin

    return Twin(folder, verify=verify)


def load_scene(scene: str | Path, dataset: str | Path | None = None) -> Scene:
    """Load a scene of ``manitwin layout`` by its file or folder; ``dataset`` None: the one that it was sampled from.

    Raises UsageError where the scene cannot be read, or does not lie in the folder that says whose twins it has.
    """
    from manitwin.scenes.loaded_scene import Scene
    from manitwin.scenes.scene_files import dataset_of

    return Scene.read(scene, dataset_of(Path(scene)) if dataset is None else dataset)


def export_twin(
    twin: Twin | str | Path, to: str | Iterable[str], out: str | Path, *, license_allow: Iterable[str] | None = None
) -> dict[str, Path]:
    """Write a twin in formats (``"mjcf"``, ``["urdf", "usd"]``, ``"all"``) below ``out``; returns the file to open of each.

    Raises UsageError for an unknown format, ExportError for a licence that is not allowed or a twin that a format cannot take.
    """
    from manitwin.assets.writers.exporter import TwinContent
    from manitwin.assets.writers.registry import chosen_formats
    from manitwin.assets.writers.write import export_twin as write
    from manitwin.twin.loaded_twin import Twin

    content = TwinContent.of(twin if isinstance(twin, Twin) else Twin(twin))
    formats = chosen_formats([to] if isinstance(to, str) else to)
    return {name: write(content, name, out, license_allow=license_allow) for name in formats}


def import_assets(
    paths: str | Path | Iterable[str | Path],
    out: str | Path,
    *,
    format: Format | Literal["auto"] = "auto",
    lock_joints: bool = False,
) -> list[Imported]:
    """Import all assets at and below ``paths`` into folders below ``out`` that ``build`` takes; return what became of each.

    What moves by joints is kept with its links and joints (URDF, MJCF, SDF), of other formats the first rigid part is taken; with
    ``lock_joints`` all of it (URDF, MJCF, SDF) is one rigid body as the file stands. An asset that cannot be read has an
    ``error`` and no folder. Nothing is written over. Raises UsageError for a path that is not there, and where a folder of
    another kind has an asset's name.
    """
    from manitwin.assets.importers.importer import import_assets as imported

    given = [paths] if isinstance(paths, str | Path) else paths
    return list(imported([Path(path) for path in given], Path(out), format=format, lock_joints=lock_joints))


Settings = TypeVar("Settings", "LayoutsConfig", "TasksConfig", "TrajectoriesConfig", "PicturesConfig")


def _settings(kind: type[Settings], config: Settings | str | Path | None, jobs: int | None) -> Settings:
    """Return an application's settings: given, of a TOML file, or the default ones; raises ConfigError and UsageError."""
    from manitwin.config import MOST_SLOTS, load_config

    if jobs is not None and not 1 <= jobs <= MOST_SLOTS:
        raise UsageError(f"jobs is {jobs:.6g}; give 1 to {MOST_SLOTS}")
    settings = (
        config if isinstance(config, kind) else kind() if config is None else load_config(Path(str(config)), kind)
    )
    if jobs is None:
        return settings
    return settings.model_copy(update={"run": settings.run.model_copy(update={"cpu": jobs})})


def make_layouts(
    dataset: str | Path,
    out: str | Path,
    count: int = 100,
    *,
    config: LayoutsConfig | str | Path | None = None,
    jobs: int | None = None,
    **run: Unpack[RunOptions],
) -> RunReport:
    """Sample ``count`` scenes of a data set's twins at rest below ``out``; those that are there stay (docs/layouts.md).

    ``config``: the settings or a TOML file of them; with its ``pictures`` each scene is drawn. ``jobs``: how many processes,
    by default one a core. ``find_scenes`` lists the accepted ones. Raises UsageError for a data set without twins, categories
    that it has not, scenes of other settings at ``out``, or where another run is at work there.
    """
    from manitwin.scenes.layouts.layouts_run import make_layouts as make
    from manitwin.scenes.settings import LayoutsConfig

    settings = _settings(LayoutsConfig, config, jobs)
    return make(dataset, out, count, settings, **run)


def find_scenes(place: str | Path) -> list[Path]:
    """Return the files of the scenes at ``place``: a file, a scene's folder, or all that ``make_layouts`` wrote there.

    Raises UsageError where there is none.
    """
    from manitwin.scenes.scene_files import scene_files

    found = scene_files(Path(place))
    if not found:
        raise UsageError(f"{place}: no scene there; `manitwin layout DATASET -o {place}` makes some")
    return found


def export_scene(scene: Scene | str | Path, to: str | Iterable[str], out: str | Path) -> dict[str, Path]:
    """Write a scene in formats (``"mjcf"``, ``["mjcf", "usd"]``, ``"all"``) below ``out``; return the file to open of each.

    An earlier export there is replaced. Raises UsageError for an unknown format and a scene or twin that is not there,
    ExportError for what cannot be written.
    """
    from manitwin.assets.writers.write import write_exported
    from manitwin.errors import choose_from
    from manitwin.scenes.layouts.export_mjcf import export_mjcf
    from manitwin.scenes.layouts.export_usd import export_usd

    exporters = {"mjcf": export_mjcf, "usd": export_usd}
    asked = [to] if isinstance(to, str) else list(to)
    names = list(exporters) if "all" in asked else asked
    for name in names:
        if name not in exporters:
            raise UsageError(choose_from("format of a scene", name, exporters))
    loaded = load_scene(scene) if isinstance(scene, str | Path) else scene
    place = Path(out) / loaded.record.scene_id
    return {name: write_exported(exporters[name](loaded), place / name) for name in names}


@dataclass(frozen=True)
class EpisodesReport:
    """The outcome of ``make_episodes``.

    ``totals`` and ``lines``, the same in words, are None and empty where the run has not ended; ``retired`` are all grasps
    that fail end to end, ``newly_retired`` how many of them were retired just now.
    """

    run: RunReport
    totals: AttemptTotals | None = None
    lines: list[str] = field(default_factory=list)
    retired: list[Retirement] = field(default_factory=list)
    newly_retired: int = 0


def make_episodes(
    source: str | Path,
    out: str | Path,
    count: int = 100,
    *,
    config: TrajectoriesConfig | str | Path | None = None,
    twins: str | Path | None = None,
    formats: Iterable[str] = ("lerobot", "maniskill"),
    retire: bool = True,
    jobs: int | None = None,
    **run: Unpack[RunOptions],
) -> EpisodesReport:
    """Attempt ``count`` pick-and-place episodes with the twins of a data set or in scenes, and keep what succeeded.

    ``out`` gets ``attempts.parquet`` and the data sets of ``formats`` (docs/episodes.md); episodes that are there stay.
    ``twins``: where the twins of scenes are now. ``retire`` marks grasps that fail in their twins' records.
    Raises UsageError for a source without twins or scenes, an unknown robot or format, an ``out`` made with other settings,
    or where another run is at work there.
    """
    from manitwin.episodes.collect import chosen_formats, collect
    from manitwin.episodes.episodes_run import make_episodes as make_batches
    from manitwin.episodes.episodes_run import retire_failing
    from manitwin.episodes.settings import TrajectoriesConfig

    settings, wanted = _settings(TrajectoriesConfig, config, jobs), chosen_formats(formats)
    ended = make_batches(source, out, count, settings, twins=twins, **run)
    if ended.exit_code == 4:
        return EpisodesReport(ended)
    collected = collect(Path(out), wanted)
    retired, fresh = retire_failing(Path(out)) if retire else ([], 0)
    return EpisodesReport(ended, collected.totals, collected.lines, retired, fresh)


@dataclass(frozen=True)
class TasksReport:
    """The outcome of ``make_tasks``; ``totals`` are None where the run has not ended.

    ``bddl`` has how many tasks were written as BDDL and how many could not be, None where that was not asked for.
    """

    run: RunReport
    totals: TaskTotals | None = None
    bddl: tuple[int, int] | None = None


def make_tasks(
    scenes: str | Path,
    out: str | Path,
    *,
    config: TasksConfig | str | Path | None = None,
    twins: str | Path | None = None,
    bddl: bool = False,
    jobs: int | None = None,
    **run: Unpack[RunOptions],
) -> TasksReport:
    """Find tasks in the scenes of a folder, check each by planning, and write ``tasks.jsonl`` with instructions.

    ``twins``: where the twins of the scenes are now. ``bddl`` also writes what BDDL can say. Raises UsageError for a place
    without scenes, an unknown robot, an ``out`` made with other settings, or where another run is at work there.
    """
    from manitwin.episodes.settings import TasksConfig
    from manitwin.episodes.tasks.tasks_run import export_bddl
    from manitwin.episodes.tasks.tasks_run import make_tasks as make

    ended, totals = make(scenes, out, _settings(TasksConfig, config, jobs), twins=twins, **run)
    return TasksReport(ended, totals, export_bddl(Path(out)) if bddl and totals is not None else None)


def make_env(
    tasks: str | Path,
    task_id: str | None = None,
    *,
    twins: str | Path | None = None,
    robot: str | None = None,
    cameras: Sequence[str] = (),
    picture_px: int = 128,
    max_steps: int = 1200,
    start_noise: StartNoise | None = None,
) -> TaskEnvironment:
    """Return the Gymnasium environment of a task of a file or folder of tasks; the only one needs no ``task_id``.

    Observations are states, with pictures of ``cameras`` besides; docs/policies.md says what is in them and what an action is.
    ``twins``: where the twins are now. An episode is cut off after ``max_steps`` steps of 1/20 s. With ``start_noise`` the
    seeds of ``reset`` draw other starts. Raises UsageError for an unknown task or camera, and for a scene that is another one
    than the task's.
    """
    from manitwin.episodes.environment.make import make_env as make

    return make(
        tasks,
        task_id,
        twins=twins,
        robot=robot,
        cameras=cameras,
        picture_px=picture_px,
        max_steps=max_steps,
        start_noise=start_noise,
    )


def render_episodes(
    episodes: str | Path,
    *,
    config: PicturesConfig | str | Path | None = None,
    twins: str | Path | None = None,
    jobs: int | None = None,
    on_written: Callable[[LeRobotSummary], None] = lambda summary: None,
    **run: Unpack[RunOptions],
) -> RunReport:
    """Draw the kept episodes of a folder by showing their states again, and write its LeRobot data set with the films.

    ``twins``: where their twins are now. What is drawn already stays. Raises EpisodesError where there are no episodes,
    UsageError for an unknown camera, RendererMissing, and Unavailable without an encoder.
    """
    from manitwin.episodes.episode_pictures import draw_episodes, write_with_pictures
    from manitwin.episodes.settings import PicturesConfig
    from manitwin.episodes.video import require_encoder
    from manitwin.render.device import require_renderer

    settings = _settings(PicturesConfig, config, jobs)
    if run.get("executor") != "ray":
        require_renderer()
        require_encoder(settings.codec)
    report = draw_episodes(Path(episodes), settings, twins=twins, **run)
    if report.exit_code != 4:
        on_written(write_with_pictures(Path(episodes), settings.cameras))
    return report


def write_index(
    dataset: str | Path,
    *,
    jobs: int | None = None,
    on_start: Callable[[int], None] = lambda twins: None,
    on_read: Callable[[int], None] = lambda twins: None,
) -> Rebuilt:
    """Write the index of a data set again from its twins alone, in ``jobs`` processes; the old one serves until then.

    ``on_start`` is called with the number of twins, ``on_read`` with that of those just read.
    Raises UsageError where there is no data set, TwinError where a process dies: nothing has changed then.
    """
    from manitwin.dataset.index.rebuild import rebuild
    from manitwin.twin.dataset_root import DatasetRoot

    return rebuild(DatasetRoot(dataset), jobs=jobs or os.cpu_count() or 1, on_start=on_start, on_read=on_read)


def write_statistics(dataset: str | Path, out: str | Path | None = None) -> WrittenReport:
    """Write the statistics of a data set, or of a folder of episodes, as a page, its figures, and its numbers with their SQL.

    ``out`` None: ``statistics/`` below it. Raises UsageError where a data set has no index.
    """
    from manitwin.dataset.statistics.report import WrittenReport, write_dataset_report
    from manitwin.episodes.attempts import ATTEMPTS
    from manitwin.twin.dataset_root import DatasetRoot

    root = DatasetRoot(dataset)
    if root.local is None or not root.exists(ATTEMPTS):
        return write_dataset_report(root, None if out is None else Path(out))
    from manitwin.episodes.statistics.report import episode_statistics

    report = episode_statistics(root.local)
    page = report.write(Path(out or root.local / "statistics"))
    return WrittenReport(str(page), report.summary.rstrip("."), report.text())


def statistics_connection(dataset: str | Path) -> duckdb.DuckDBPyConnection:
    """Return DuckDB with the tables of a data set's index and the macros of ``manitwin stats``, for queries of its report.

    Raises UsageError where there is no index.
    """
    from manitwin.dataset.statistics.query import ReportTables
    from manitwin.twin.dataset_root import DatasetRoot

    return ReportTables.of_index(DatasetRoot(dataset)).connection


def schema() -> dict[str, Any]:
    """Return the JSON Schema of twin.json."""
    from manitwin.twin.record import TwinRecord

    return TwinRecord.model_json_schema()
