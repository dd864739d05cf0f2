"""Repair of a data set before a run: missing or damaged folders and tables are made again."""

from __future__ import annotations

import logging
import os
from collections.abc import Collection
from pathlib import Path

from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.recipe import Recipe
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import TWINS, DatasetRoot
from manitwin.twin.store import WORK

RUN = logging.getLogger("manitwin.run")


def refuse_links(root: DatasetRoot) -> None:
    """Raise UsageError if a folder that a run writes into is a symbolic link out of the root."""
    if root.local is None:
        return
    inside = root.local.resolve()
    prefixes = sorted((root.local / TWINS).glob("*")) if (root.local / TWINS).is_dir() else []
    for place in (root.local / WORK, root.local / TWINS, root.local / "index", *prefixes):
        if os.path.islink(place) and not Path(os.path.realpath(place)).is_relative_to(inside):
            raise UsageError(
                f"{place}: a link to a place outside {root.url}, where nothing is written; replace the link by the"
                f" folder"
            )


def heal(ledger: Ledger, root: DatasetRoot, recipe: Recipe, given: Collection[int]) -> list[str]:
    """Reopen items that ended but whose folders are missing or damaged, among the given items or all; return remarks on them.

    Only cheap checks on a local disk are made. A data set at a URL is not checked, because each check would be a request: use
    ``manitwin check`` there.
    """
    remarks: list[str] = []
    if root.local is None:
        return remarks
    damaged: list[int] = []
    for number, item_id in ledger.ended_items(given):
        wrong = recipe.damage(root, item_id)
        if wrong:
            RUN.warning("item %d, %s: %s; it is made again", number, item_id, wrong)
            root.remove(f"{recipe.folder_of(item_id)}/{recipe.record}")  # the other files stay until they are replaced
            damaged.append(number)
    if damaged:
        ledger.reopen(damaged)
        remarks.append(f"{len(damaged)} finished folders were missing or damaged: they are built again")
    if recipe.tables is not None and ledger.any_indexed() and recipe.tables.heal(root):
        ledger.clear_indexed()
        remarks.append("the index was missing, damaged or of another version: it is rebuilt")
    return remarks
