"""Static pages of selected twins, scenes or episodes, to open from disk, host on any web server, or send."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import numpy as np

from manitwin.errors import TwinError, UsageError
from manitwin.formats.output_folder import new_folder
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin
from manitwin.web.card_tables import WORDS
from manitwin.web.episode_folders import EpisodeFolders, has_episodes
from manitwin.web.gallery_page import static_gallery_page
from manitwin.web.gallery_query import Gallery, View
from manitwin.web.html import GALLERY, STYLE
from manitwin.web.links import FileLinks
from manitwin.web.package_files import LICENSE, package_file
from manitwin.web.scene_folders import SceneFolders, has_scenes
from manitwin.web.served_files import TwinFolders
from manitwin.web.static_episodes import write_episodes
from manitwin.web.static_scenes import write_scenes
from manitwin.web.static_scripts import write, write_twin
from manitwin.web.trial_player import TrialPlayer
from manitwin.web.twin_page import SCRIPTS

MOST_PAGES = 2_000
"""Maximum number of pages of a folder: the gallery of twins is a single page, and a twin takes a megabyte or two."""
Drawn = TypeVar("Drawn")


@dataclass
class StaticPages:
    """Summary: numbers of pages by kind, total bytes, and what was left out with the reason, by id."""

    twins: int = 0
    scenes: int = 0
    episodes: int = 0
    size_bytes: int = 0
    left_out: dict[str, str] = field(default_factory=dict)


def write_static_pages(
    place: str,
    out: Path,
    *,
    sample: int | None = None,
    seed: int = 0,
    where: str = "",
    trials: int = 0,
    twins: str | None = None,
    on_page: Callable[[str], None] = lambda name: None,
) -> StaticPages:
    """Write the pages of a place to a new folder ``out``: a data set, one twin's folder, scenes, or episodes.

    For a data set, these are the accepted twins that satisfy ``where``. Scenes and episodes are written with the pages of their
    twins; ``twins`` names the data set of an episode's twins if it is not the one they were made from. ``sample`` is the number
    of pages, drawn by the seed. For each gripper of a twin, the trials of its first ``trials`` grasps can be played. Equal input,
    sample and seed give equal bytes. Input photos are not written, since they may contain private data such as the location.
    Raises UsageError if there are no pages, or more than ``MOST_PAGES``.
    """
    with TemporaryDirectory(prefix="manitwin-view-") as cache, TrialPlayer() as player:
        if where and (has_episodes(place) or has_scenes(place)):
            raise UsageError(f"{place}: --where chooses twins of a data set, and there are none; leave it out")
        if has_episodes(place):
            return _of_episodes(EpisodeFolders(place, Path(cache), twins), place, out, sample, seed, on_page)
        if twins is not None:
            raise UsageError(f"{place}: --twins is for episodes, and there are none")
        if has_scenes(place):
            return _of_scenes(SceneFolders(place, Path(cache)), place, out, sample, seed, on_page)
        folders = TwinFolders(place, Path(cache) if "://" in place else None)
        rows, title = _rows(place, folders, sample, where)
        chosen = sample_items(rows, place, sample, seed, "accepted twin is chosen; give another --where")

        def write_one(fresh: Path, twin_id: str) -> int:
            return write_twin(fresh, folders.twin(twin_id), player=player, trials=trials)

        return _of_twins(chosen, title, folders.only is None, out, write_one, on_page)


def sample_items(all_of_them: Sequence[Drawn], place: str, sample: int | None, seed: int, none: str) -> list[Drawn]:
    """Return all items, or ``sample`` of them drawn by the seed, in order; raises UsageError for none and for too many."""
    chosen = list(all_of_them)
    if sample is not None and sample < len(chosen):
        drawn = np.random.default_rng(seed).choice(len(chosen), sample, replace=False)
        chosen = [chosen[i] for i in sorted(drawn)]
    if not chosen:
        raise UsageError(f"{place}: no {none}")
    if len(chosen) > MOST_PAGES:
        raise UsageError(f"{place}: {len(chosen):,} are chosen, {MOST_PAGES:,} at most; give --sample")
    return chosen


def _rows(place: str, twins: TwinFolders, sample: int | None, where: str) -> tuple[list[dict[str, Any]], str]:
    """Return the card rows of the twins, and the title of the gallery."""
    if twins.only is None:
        root = DatasetRoot(place)
        return Gallery(root).all_rows(View(where=where)), Path(root.path).name or "twins"
    if where or sample is not None:
        raise UsageError(f"{place}: is one twin, of which there is nothing to choose; leave out --sample and --where")
    return [_row(twins.only)], twins.only.record.name or twins.only.record.twin_id


def _of_twins(
    rows: list[dict[str, Any]],
    title: str,
    is_dataset: bool,
    out: Path,
    write_one: Callable[[Path, str], int],
    on_page: Callable[[str], None],
) -> StaticPages:
    done = StaticPages()
    with new_folder(out) as fresh:
        written = []
        for row in rows:
            try:
                done.size_bytes += write_one(fresh, row["twin_id"])
                written.append(row)
            except (TwinError, UsageError) as error:
                done.left_out[row["twin_id"]] = str(error)
            on_page(row["twin_id"])
        said = f"{len(written):,} accepted twins" + (f" of {title}" if is_dataset else "")
        page = static_gallery_page(written, "accepted", title, said, FileLinks())
        done.size_bytes += write(fresh / "index.html", page.encode()) + _write_package_files(fresh, GALLERY, *SCRIPTS)
    done.twins = len(written)
    return done


def _of_scenes(
    scenes: SceneFolders, place: str, out: Path, sample: int | None, seed: int, on_page: Callable[[str], None]
) -> StaticPages:
    chosen = sample_items(scenes.ids, place, sample, seed, "scene is there")
    with new_folder(out) as fresh:
        written = write_scenes(fresh, scenes, chosen, Path(place).resolve().name, on_page)
        size = written.size_bytes + _write_package_files(fresh, *written.scripts)
    return StaticPages(len(written.twins), scenes=written.pages, size_bytes=size, left_out=written.left_out)


def _of_episodes(
    episodes: EpisodeFolders, place: str, out: Path, sample: int | None, seed: int, on_page: Callable[[str], None]
) -> StaticPages:
    chosen = sample_items(range(len(episodes)), place, sample, seed, "recorded episode is there")
    with new_folder(out) as fresh:
        written = write_episodes(fresh, episodes, chosen, Path(place).resolve().name, on_page)
        size = written.size_bytes + _write_package_files(fresh, *written.scripts)
    return StaticPages(len(written.twins), episodes=written.pages, size_bytes=size, left_out=written.left_out)


def _write_package_files(fresh: Path, *scripts: str) -> int:
    names = dict.fromkeys((STYLE, *scripts, LICENSE))
    return sum(write(fresh / "static" / name, package_file(name)) for name in names)


def _row(twin: Twin) -> dict[str, Any]:
    """Return the card row of one twin; raises UsageError for a rejected one."""
    record = twin.record
    if record.physical is None or record.language is None or record.grasps is None:
        raise UsageError(f"{twin.folder}: is no accepted twin; plain files show those that were accepted")
    robustness, language = record.grasps.robustness, record.language
    words = (record.twin_id, record.name, language.category, language.color, language.material, language.caption)
    return {
        WORDS: " ".join(filter(None, words)).lower(),
        "twin_id": record.twin_id,
        "revision": record.revision,
        "name": record.name,
        "category": record.language.category,
        "material": record.language.material,
        "longest_m": record.physical.longest_m,
        "mass_kg": record.physical.mass_kg.value,
        "simulated": record.grasps.simulated,
        "verified": record.grasps.verified,
        "robustness_median": robustness.median if robustness else None,
    }
