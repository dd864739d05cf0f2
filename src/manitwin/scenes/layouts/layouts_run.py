"""Generation of many layouts by the engine, and totals over a run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Unpack

from pydantic import ValidationError

from manitwin.config import LARGEST_COUNT
from manitwin.engine.drive import RunOptions, RunReport, drive
from manitwin.engine.ledger.location import CONFIG, local_ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import UsageError
from manitwin.scenes.changed_twins import find_changed_twins
from manitwin.scenes.layouts.layouts_recipe import LayoutNumber, LayoutsRecipe
from manitwin.scenes.layouts.pool import Pool, cached_pool
from manitwin.scenes.layouts.slot_sampling import least_objects
from manitwin.scenes.run_settings import check_settings, earlier_settings
from manitwin.scenes.scene import SCENE, SceneRecord
from manitwin.scenes.scene_files import parse_scene, read_scene_content, scene_name
from manitwin.scenes.settings import LayoutsConfig
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record_digests import TwinState

CONTACT_SHEET = "contact_sheet.webp"
DECIDE_NO_SCENE = frozenset(("dataset", "run", "pictures", "picture_px"))


@dataclass(frozen=True)
class LayoutTotals:
    """Totals of all layouts below a root; maxima of the measures are over accepted layouts."""

    accepted: int
    rejected: dict[str, int]
    repaired: int
    objects: int
    max_moved_m: float
    max_turned_rad: float
    max_penetration_m: float
    cpu_seconds: float

    @property
    def acceptance(self) -> float:
        """The share of accepted layouts among completed ones."""
        return self.accepted / max(1, self.accepted + sum(self.rejected.values()))


def make_layouts(
    dataset: str | Path,
    out: str | Path,
    count: int,
    config: LayoutsConfig,
    **run: Unpack[RunOptions],
) -> RunReport:
    """Sample the layouts number 0 to ``count - 1`` of a data set's twins below ``out``; existing ones are kept.

    If an earlier run rendered scenes, ``pictures`` stays enabled. An outdated contact sheet is removed before new scenes are
    made. Raises UsageError for a data set without twins, unavailable categories, a lack of containers or supporting objects,
    scenes with other settings at ``out``, or another run in progress there.
    """
    if not 1 <= count <= LARGEST_COUNT:
        raise UsageError(f"{count:.6g} layouts; ask for 1 or more, at most {LARGEST_COUNT}")
    place = DatasetRoot(dataset).absolute()
    pool = cached_pool(place)
    least_objects(pool.upright if config.layout.upright else pool, config.layout)
    root = DatasetRoot(out)
    config = _with_earlier_pictures(config, earlier_settings(root), root.url)
    recipe = LayoutsRecipe(config, place, root.absolute())
    configuration = {"kind": "layouts", "dataset": place, **config.model_dump(mode="json")}
    check_settings(root, configuration, free=DECIDE_NO_SCENE, made="scenes")

    def started(items: int, opened: int) -> None:
        if opened and root.exists(CONTACT_SHEET):
            root.remove(CONTACT_SHEET)
        if "on_start" in run:
            run["on_start"](items, opened)

    watched: RunOptions = {**run, "on_start": started}
    remarks = _stale_scenes(root, pool)
    report = drive(
        recipe, map(LayoutNumber, range(count)), root, config.run, configuration=configuration, **watched
    )  # fmt: skip
    report.remarks.extend(remarks)
    return report


def _stale_scenes(root: DatasetRoot, pool: Pool) -> list[str]:
    """Return remarks on existing scenes whose twins rest differently now; the scenes are kept."""
    if not local_ledger(root).is_file():
        return []

    def there() -> Iterator[SceneRecord]:
        for scene_id in accepted_scenes(root.url):
            with suppress(UsageError):  # of a newer version, which the run reports
                if (content := read_scene_content(root, scene_id)) is not None:
                    yield parse_scene(content)

    def now(twin_id: str) -> TwinState | None:
        twin = pool.find(twin_id)
        return None if twin is None else TwinState(twin.revision, twin.body_sha256 or "", twin.grippers)

    found = find_changed_twins(there(), now)
    if found.changed_remark is None:
        return [] if found.remark is None else [found.remark]
    return [
        f"{found.changed_remark}, which are left unchanged, but rejected by tasks and episodes; sample the layouts again into"
        f" a new folder"
    ]


def _with_earlier_pictures(config: LayoutsConfig, before: dict[str, Any], place: str) -> LayoutsConfig:
    """Return a configuration that renders scenes if an earlier run did, so that its pictures are not lost."""
    if config.pictures or not before.get("pictures"):
        return config
    drawn = {"pictures": True, "picture_px": before.get("picture_px", config.picture_px)}
    try:
        return LayoutsConfig.model_validate({**config.model_dump(), **drawn}, strict=True)
    except ValidationError as error:
        raise UsageError(
            f"{place}/{CONFIG}: its picture_px is not a picture size; remove the file: the next run writes a new one"
        ) from error


def twins_without_upright(dataset: str | Path) -> tuple[str, ...]:
    """Return the ids of a data set's twins that have no upright placement; ``upright`` layouts place them as they rest."""
    return tuple(
        twin.twin_id for twin in cached_pool(DatasetRoot(dataset).absolute()).twins if not twin.has_upright_pose
    )


def accepted_scenes(out: str | Path) -> list[str]:
    """Return the ids of a run's accepted scenes in the order of their numbers."""
    with read_ledger(local_ledger(DatasetRoot(out))) as ledger:
        return [row[0] for row in ledger.execute("SELECT twin_id FROM items WHERE state = 'accepted' ORDER BY number")]


def _scene(root: DatasetRoot, scene_id: str) -> SceneRecord:
    name = f"{scene_name(scene_id)}/{SCENE}"
    try:
        return parse_scene(root.read_bytes(name, UsageError), root.full(name))
    except FileNotFoundError as error:
        raise UsageError(f"{root.full(name)}: missing; rerun manitwin layout to make it again") from error


def layout_totals(out: str | Path) -> LayoutTotals:
    """Compute the totals from the ledger and the scenes."""
    root = DatasetRoot(out)
    with read_ledger(local_ledger(root)) as ledger:
        rows = ledger.execute(
            "SELECT reason, count(*) FROM items WHERE state = 'rejected' GROUP BY reason ORDER BY reason"
        )
        rejected = {str(reason): int(count) for reason, count in rows}
        (cpu_seconds,) = ledger.execute("SELECT coalesce(sum(cpu_seconds), 0) FROM stages").fetchone()
    scenes = [_scene(root, each) for each in accepted_scenes(out)]
    return LayoutTotals(
        accepted=len(scenes),
        rejected=rejected,
        repaired=sum(scene.repairs > 0 for scene in scenes),
        objects=sum(len(scene.objects) for scene in scenes),
        max_moved_m=max((scene.measures.max_moved_m for scene in scenes), default=0.0),
        max_turned_rad=max((scene.measures.max_turned_rad for scene in scenes), default=0.0),
        max_penetration_m=max((scene.measures.max_penetration_m for scene in scenes), default=0.0),
        cpu_seconds=float(cpu_seconds),
    )
