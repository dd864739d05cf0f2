"""Ledgers that earlier versions wrote: their rows are the items of now, and a run goes on with them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest

from manitwin.config import RunConfig
from manitwin.engine.drive import drive
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.engine.task import Payload
from manitwin.episodes.batch import Batch
from manitwin.episodes.episode_pictures import BatchRendering
from manitwin.pipeline.item import Item
from manitwin.scenes.layouts.layouts_recipe import LayoutNumber
from manitwin.twin.dataset_root import DatasetRoot
from rehearsal_recipe import RehearsalRecipe

UNSAID = {"file": None, "name": None, "units": "auto", "up": "auto", "license": None, "attribution": None}
BATCHES = (Batch("panda", 0, 2, twin_id="a"), Batch("panda", 1, 2, scene_id="layout_0_000001", step=4))
BATCH_TEXTS = (
    '{"count": 2, "first": 0, "robot": "panda", "scene_id": null, "twin_id": "a"}',
    '{"count": 2, "first": 1, "robot": "panda", "scene_id": "layout_0_000001", "step": 4, "twin_id": null}',
)


def write_earlier(path: Path, texts: tuple[str, ...], endings: tuple[str, ...] = ()) -> None:
    """Write a ledger whose items are texts, as the version before payloads did; the first have ended."""
    path.parent.mkdir(parents=True, exist_ok=True)
    ledger = Ledger(path)
    for text in texts:
        row = json.dumps({**UNSAID, "text": text}, sort_keys=True)
        ledger.connection.execute("INSERT INTO items (item) VALUES (?)", (row,))
    for number, twin_id in enumerate(endings, 1):
        ledger.identify(number, twin_id, "text")
        ledger.item_ended(number, "accepted", recipe_sha256=RECIPE.sha256, revision="r")
    ledger.close()


@dataclass(frozen=True)
class RehearsedRecipe(RehearsalRecipe):
    """A rehearsal whose tasks ask for layouts by their numbers."""

    payload: ClassVar[Any] = LayoutNumber

    def identify(self, payload: Any) -> Any:
        return super().identify(Item(None, f"{payload.number}"))

    def stages(self, kind: str) -> list[Any]:
        return []

    def write(self, draft: Any, *given: Any, **more: Any) -> Any:
        draft.payload = Item(None, f"{draft.payload.number}")
        return super().write(draft, *given, **more)


RECIPE = RehearsedRecipe()


@pytest.mark.parametrize(
    ("texts", "payloads"),
    [
        (("layout 0", "layout 17"), (LayoutNumber(0), LayoutNumber(17))),
        (BATCH_TEXTS, BATCHES),
        (("0123", "4567"), (BatchRendering("0123"), BatchRendering("4567"))),
        (("a mug", "layout 17"), (Item(None, "a mug"), Item(None, "layout 17"))),
    ],
)
def test_what_was_a_text_is_the_same_item_now(
    tmp_path: Path, texts: tuple[str, ...], payloads: tuple[Payload, ...]
) -> None:
    path = tmp_path / "ledger.sqlite"
    write_earlier(path, texts)
    ledger = Ledger(path)
    ledger.rewrite_payloads(type(payloads[0]).from_json)
    assert ledger.add_items(payloads) == ([1, 2], 0), "nothing is new"
    opened = [type(payloads[0]).from_json(each.payload) for each in ledger.next_open(0, 10)]
    assert opened == list(payloads)
    ledger.close()


def test_a_run_that_was_half_done_goes_on(tmp_path: Path) -> None:
    done = tuple(RECIPE.identify(LayoutNumber(n)).item_id for n in range(2))
    settings = RunConfig(patience_s=0)
    drive(RECIPE, map(LayoutNumber, range(2)), DatasetRoot(tmp_path), settings, configuration={}, executor="inline")
    for file in tmp_path.glob("ledger.*"):
        file.unlink()
    write_earlier(tmp_path / "ledger.sqlite", ("layout 0", "layout 1", "layout 2"), done)
    opened: list[tuple[int, int]] = []
    report = drive(
        RECIPE, map(LayoutNumber, range(4)), DatasetRoot(tmp_path), settings, configuration={},
        executor="inline", on_start=lambda items, left: opened.append((items, left)),
    )  # fmt: skip
    assert opened == [(4, 2)] and report.counts == {"accepted": 4}
    with read_ledger(tmp_path / "ledger.sqlite") as ledger:
        rows: list[Mapping[str, Any]] = ledger.execute("SELECT item, state FROM items ORDER BY number").fetchall()
    assert [(json.loads(row["item"]), row["state"]) for row in rows] == [({"number": n}, "accepted") for n in range(4)]
