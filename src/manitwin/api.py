"""What a program imports: build twins and load them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from manitwin.errors import UsageError

if TYPE_CHECKING:  # what only a build needs takes 2 CPU-seconds to import
    import duckdb

    from manitwin.config import BuildConfig
    from manitwin.engine.events import OnStage
    from manitwin.engine.stage import Item
    from manitwin.pipeline.build_item import ItemResult
    from manitwin.pipeline.folder_listing import FolderListing
    from manitwin.pipeline.manifest import Notes
    from manitwin.scenes.loaded_scene import Scene
    from manitwin.twin.loaded_twin import Twin
    from manitwin.twin.record import TwinRecord


@dataclass(frozen=True)
class BuildReport:
    """What became of every item of a build, in the order in which they ended, and of every file of a folder given to it."""

    results: list[ItemResult]
    remarks: list[str] = field(default_factory=list)
    folders: list[FolderListing] = field(default_factory=list)

    def count(self, status: str) -> int:
        """Return how many items ended as 'accepted', 'rejected' or 'unfinished'."""
        return sum(result.status == status for result in self.results)

    def records(self) -> Iterator[TwinRecord]:
        """Read the records of the accepted twins, one after the other."""
        from manitwin.twin.store import read_record

        return (read_record(r.folder) for r in self.results if r.status == "accepted" and r.folder is not None)

    @property
    def exit_code(self) -> int:
        """0 all accepted, 3 some rejected, 4 some unfinished and resumable."""
        return 4 if self.count("unfinished") else 3 if self.count("rejected") else 0


def build(
    inputs: str | Path | Iterable[str | Path],
    out: str | Path,
    *,
    texts: Iterable[str] = (),
    name: str | None = None,
    units: str = "auto",
    up: str = "auto",
    license: str | None = None,
    attribution: str | None = None,
    strict: bool = False,
    jobs: int | None = None,
    seed: int | None = None,
    config: BuildConfig | str | Path | None = None,
    grippers: Iterable[str] | None = None,
    vlm: str | None = None,
    generator: str | None = None,
    grasper: str | None = None,
    max_cost_usd: float | None = None,
    record: str | Path | None = None,
    require_agreement: bool = False,
    quick: bool = False,
    on_estimate: Callable[[dict[str, float]], None] = lambda usd_by_kind: None,
    on_start: Callable[[int], None] = lambda total: None,
    on_stage: OnStage = lambda event: None,
    on_result: Callable[[ItemResult], None] = lambda result: None,
) -> BuildReport:
    """Build twins from images, meshes, folders, manifests and ``texts`` into the folder ``out``.

    ``units`` m|cm|mm|auto and ``up`` y|z|auto hold for all inputs whose manifest row does not say otherwise; with
    ``strict`` a manifest's column that nobody knows is an error. A finished twin of the same configuration and seed is not
    built again. ``grippers``: names or .toml files, the first one's grasps are the
    twin's own. ``vlm``, ``generator`` and ``grasper`` choose backends (docs/backends.md); once services have charged
    ``max_cost_usd``, items that would cost more are left unfinished. ``record`` is a file that a VLM's answers are added to.
    ``require_agreement`` verifies only what a second engine holds too; ``quick`` leaves out second engine and robustness.
    Raises UsageError for wrong arguments; what happens to one item is in the report and never raised.
    """
    if jobs is not None and jobs < 1:
        raise UsageError(f"jobs is {jobs}; give 1 or more")
    request = request_build(
        inputs,
        out,
        texts,
        config,
        defaults={
            "name": name, "units": units, "up": up, "license": license, "attribution": attribution, "strict": strict,
        },
        flags={
            "seed": seed, "grippers": grippers, "vlm": vlm, "generator": generator, "grasper": grasper,
            "max_cost_usd": max_cost_usd, "record": record, "require_agreement": require_agreement, "quick": quick,
        },
    )  # fmt: skip
    from manitwin.pipeline.recipe import estimate_usd, log_choices
    from manitwin.pipeline.whole_items import build_all

    settings, items, place = request.settings, request.items, request.place
    log_choices(settings)
    place.mkdir(parents=True, exist_ok=True)
    on_estimate(estimate_usd(settings))
    on_start(len(items))
    results: list[ItemResult] = []
    for result in build_all(items, place.resolve(), settings, jobs=jobs or os.cpu_count() or 1, on_stage=on_stage):
        results.append(result)
        on_result(result)
    return BuildReport(results, request.notes.remarks, request.notes.folders)


@dataclass(frozen=True)
class BuildRequest:
    """What ``build`` is asked for, checked: nothing is written yet."""

    settings: BuildConfig
    items: list[Item]
    notes: Notes
    place: Path


def request_build(
    inputs: str | Path | Iterable[str | Path],
    out: str | Path,
    texts: Iterable[str],
    config: BuildConfig | str | Path | None,
    *,
    defaults: Mapping[str, Any],
    flags: Mapping[str, Any],
) -> BuildRequest:
    """Read what ``build`` is asked for; ``defaults`` are its arguments of ``collect_items``, ``flags`` those of ``with_flags``.

    Raises UsageError for wrong arguments.
    """
    from manitwin.config import BuildConfig, load_config
    from manitwin.formats.output_folder import require_writable_folder
    from manitwin.pipeline.generator_input import refusal
    from manitwin.pipeline.manifest import collect_items

    settings = config if isinstance(config, BuildConfig) else load_config(Path(config)) if config else BuildConfig()
    settings = with_flags(settings, **flags)
    given = [inputs] if isinstance(inputs, str | Path) else list(inputs)
    items, notes = collect_items(given, texts, refusal=refusal(settings), **defaults)
    if not items:
        raise UsageError("nothing to build; give images, meshes, folders, manifests or texts")
    place = Path(out)
    require_writable_folder(place, "twins")
    # this takes two CPU-seconds to import: what was given wrongly is said before
    from manitwin.pipeline.recipe import check_names

    check_names(settings)
    return BuildRequest(settings, items, notes, place)


def with_flags(
    settings: BuildConfig,
    *,
    seed: int | None = None,
    grippers: Iterable[str] | None = None,
    vlm: str | None = None,
    generator: str | None = None,
    grasper: str | None = None,
    max_cost_usd: float | None = None,
    record: str | Path | None = None,
    require_agreement: bool = False,
    quick: bool = False,
) -> BuildConfig:
    """Return the settings with what a command line says on top; raises UsageError where two of it contradict each other."""
    if quick and require_agreement:
        raise UsageError("quick leaves the second engine out, and require-agreement asks for it; give one of them")
    said = {"seed": seed, "annotator": vlm, "generator": generator, "grasper": grasper}
    update: dict[str, Any] = {name: value for name, value in said.items() if value is not None}
    if max_cost_usd is not None and max_cost_usd <= 0:
        raise UsageError(f"max_cost_usd is {max_cost_usd:g}; give more than 0")
    services = {"max_cost_usd": max_cost_usd, "record": None if record is None else Path(record).absolute()}
    said_of_services = {name: value for name, value in services.items() if value is not None}
    update["services"] = settings.services.model_copy(update=said_of_services)
    if grippers is not None:
        update["grippers"] = tuple(grippers)
    if require_agreement:
        update["second_opinion"] = settings.second_opinion.model_copy(
            update={"enabled": True, "require_agreement": True}
        )
    if quick:
        update["second_opinion"] = settings.second_opinion.model_copy(update={"enabled": False})
        update["robustness"] = settings.robustness.model_copy(update={"enabled": False})
    return settings.model_copy(update=update)


def load(folder: str | Path, verify: bool = False) -> Twin:
    """Load a finished twin; with ``verify``, check the digest of every file. Raises TwinError."""
    from manitwin.twin.loaded_twin import Twin

    return Twin(folder, verify=verify)


def load_scene(scene: str | Path, dataset: str | Path | None = None) -> Scene:
    """Load a scene of ``manitwin layout`` by its file or folder; ``dataset`` None: the one that it was sampled from.

    Raises UsageError where the scene cannot be read, or does not lie in the folder that says whose twins it has.
    """
    from manitwin.scenes.loaded_scene import Scene
    from manitwin.scenes.scene_folders import dataset_of

    return Scene.read(scene, dataset_of(Path(scene)) if dataset is None else dataset)


def export_twin(
    twin: Twin | str | Path, to: str | Iterable[str], out: str | Path, *, license_allow: Iterable[str] | None = None
) -> dict[str, Path]:
    """Write a twin in formats (``"mjcf"``, ``["urdf", "usd"]``, ``"all"``) below ``out``; returns the file to open of each.

    Raises UsageError for an unknown format, ExportError for a licence that is not allowed or a twin that a format cannot take.
    """
    from manitwin.assets.writers.content import TwinContent
    from manitwin.assets.writers.registry import chosen_formats
    from manitwin.assets.writers.write import export_twin as write
    from manitwin.twin.loaded_twin import Twin

    content = TwinContent.of(twin if isinstance(twin, Twin) else Twin(twin))
    formats = chosen_formats([to] if isinstance(to, str) else to)
    return {name: write(content, name, out, license_allow=license_allow) for name in formats}


def statistics_connection(dataset: str | Path) -> duckdb.DuckDBPyConnection:
    """Return DuckDB with the tables of a data set's index and the macros of ``manitwin stats``, for queries of its report.

    Raises UsageError where there is no index.
    """
    from manitwin.dataset.statistics.tables import Tables
    from manitwin.twin.dataset_root import DatasetRoot

    return Tables.of_index(DatasetRoot(dataset)).connection


def schema() -> dict[str, Any]:
    """Return the JSON Schema of twin.json."""
    from manitwin.twin.record import TwinRecord

    return TwinRecord.model_json_schema()
