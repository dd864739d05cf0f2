"""Rebuild of amended items with the configuration of their data set."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Unpack

from manitwin.dataset.index.parts import IndexTables
from manitwin.engine.drive import RunOptions, RunReport, drive
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.ledger.location import local_ledger
from manitwin.pipeline.item import Item
from manitwin.pipeline.recipe import TwinRecipe
from manitwin.pipeline.settings import stored_config
from manitwin.twin.dataset_root import DatasetRoot


def rebuild_items(
    root: DatasetRoot, items: Iterable[tuple[int, Item]], jobs: int | None = None, **options: Unpack[RunOptions]
) -> RunReport:
    """Rebuild items, given with their ledger numbers, from the first stage whose amendment has changed.

    Raises UsageError if another run is active on the data set.
    """
    numbered = list(items)
    ledger = Ledger(local_ledger(root))
    try:
        ledger.reopen(number for number, _ in numbered)
    finally:
        ledger.close()
    settings = stored_config(root)
    run_settings = settings.run if jobs is None else settings.run.model_copy(update={"cpu": jobs})
    return drive(
        TwinRecipe(settings, IndexTables()), [item for _, item in numbered], root, run_settings,
        configuration=settings.model_dump(mode="json"), max_cost_usd=settings.services.max_cost_usd, **options,
    )  # fmt: skip
