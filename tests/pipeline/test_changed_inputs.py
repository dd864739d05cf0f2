"""Inputs that are changed, deleted or replaced while a run is at work on them, or between two runs."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from manitwin.config import BuildConfig, RunConfig
from manitwin.engine.drive import RunReport, drive
from manitwin.engine.events import ItemEnded, StageEnded, StageEvent
from manitwin.engine.recipe import Identity
from manitwin.errors import InputChanged, InputError
from manitwin.formats.packed_source import MAX_KEPT_BYTES
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.recipe import TwinRecipe
from manitwin.twin.dataset_root import DatasetRoot
from rehearsal_recipe import RehearsalRecipe


@dataclass(frozen=True)
class FileRecipe(RehearsalRecipe):
    """A rehearsal whose items are files, identified as inputs of twins are."""

    def identify(self, payload: Item) -> Identity:
        return replace(TwinRecipe(BuildConfig()).identify(payload), rejected=None, kind="text")


def run(folder: Path, file: Path, *, after: str = "", change: Callable[[], object] = lambda: None) -> RunReport:
    """Drive one item in this process; once the stage ``after`` has ended, ``change`` is done."""

    def heard(event: StageEvent) -> None:
        if isinstance(event, StageEnded) and event.stage == after:
            change()

    item = Item(file=str(file), text="file")
    settings = RunConfig(cpu=1)
    return drive(
        FileRecipe(),
        [item],
        DatasetRoot(folder / "data"),
        settings,
        configuration={},
        executor="inline",
        on_stage=heard,
    )


OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize("after", ["input", "a", "c"])
@pytest.mark.parametrize("change", ["changed", "deleted", "replaced by a folder", "replaced by a link", "side file"])
def test_an_input_that_changes_in_a_run_stays_open_and_leaves_nothing(tmp_path: Path, after: str, change: str) -> None:
    file = tmp_path / "cup.obj"
    (tmp_path / "other.obj").write_text(OBJ + "#")
    (tmp_path / "cup.mtl").write_text("newmtl a")
    file.write_text("mtllib cup.mtl\n" + OBJ)

    def disturb() -> None:
        if change == "side file":
            (tmp_path / "cup.mtl").write_text("newmtl b")
            return
        file.unlink()
        if change == "changed":
            file.write_text(OBJ)
        elif change == "replaced by a folder":
            file.mkdir()
        elif change == "replaced by a link":
            file.symlink_to("other.obj")

    report = run(tmp_path, file, after=after, change=disturb)
    if change == "replaced by a folder":
        assert report.counts.get("accepted") is None and report.exit_code == 4
    else:
        assert report.counts == {"open": 1} and report.exit_code == 4
    assert not list((tmp_path / "data/twins").glob("*/*")), "nothing is made of other bytes than the id says"
    if file.is_dir():
        file.rmdir()
    else:
        file.unlink(missing_ok=True)
    file.write_text("mtllib cup.mtl\n" + OBJ)
    again = run(tmp_path, file)
    assert again.counts.get("accepted") == 1 or change == "replaced by a folder"


def test_the_reason_is_one_line_with_the_remedy(tmp_path: Path) -> None:
    file = tmp_path / "cup.obj"
    file.write_text(OBJ)
    item = Item(file=str(file))
    recipe = TwinRecipe(BuildConfig())
    recipe.identify(item)
    file.unlink()
    with pytest.raises(InputChanged, match=r"^cup.obj: was removed; put it back, then rerun the same command$"):
        recipe.identify(item)


def test_an_input_that_was_mended_after_it_ended_is_looked_at_again(tmp_path: Path) -> None:
    file = tmp_path / "cup.obj"
    file.write_text(OBJ)
    ids: list[str] = []

    def build() -> RunReport:
        def ended(event: ItemEnded) -> None:
            ids.append(event.task.item_id)

        return drive(
            FileRecipe(), [Item(file=str(file), text="file")], DatasetRoot(tmp_path / "data"), RunConfig(cpu=1),
            configuration={}, executor="inline", on_ended=ended,
        )  # fmt: skip

    assert build().counts == {"accepted": 1}
    assert build().counts == {"accepted": 1} and len(ids) == 1, "what was not touched is not looked at"
    file.write_text(OBJ + "v 0 0 1\n")
    assert build().counts == {"accepted": 1}
    assert len(set(ids)) == 2, "it is another input now"


def test_a_file_beyond_all_readers_is_too_large_before_it_is_hashed(tmp_path: Path) -> None:
    file = tmp_path / "sparse.glb"
    file.write_bytes(b"glTF")
    os.truncate(file, MAX_KEPT_BYTES + 1)
    item = Item(file=str(file))
    identity = TwinRecipe(BuildConfig()).identify(item)
    assert isinstance(identity.rejected, InputError) and identity.rejected.reason == "too_large"
    before = twin_id(item)
    os.truncate(file, MAX_KEPT_BYTES + 2)
    assert twin_id(item) != before
