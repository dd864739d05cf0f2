"""What a run puts right before it begins: folders that are gone or damaged are made again, and so are tables."""

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
    """Raise UsageError where a folder that a run writes into is a link out of the root."""
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
    """Open what ended and is not there as it was written, of the given items or all; returns remarks about it.

    Looked at is what costs next to nothing on a local disk; at a URL, where each look takes a request, ``manitwin check``
    is to be asked.
    """
    remarks: list[str] = []
    if root.local is None:
        return remarks
    damaged: list[int] = []
    for number, item_id in ledger.ended(given):
        wrong = recipe.damage(root, item_id)
        if wrong:
            RUN.warning("item %d, %s: %s; it is made again", number, item_id, wrong)
            root.remove(f"{recipe.folder_of(item_id)}/{recipe.record}")  # the rest stays until another takes its place
            damaged.append(number)
    if damaged:
        ledger.reopen(damaged)
        remarks.append(f"{len(damaged)} finished folders were missing or damaged: they are built again")
    if recipe.tables is not None and ledger.any_indexed() and recipe.tables.heal(root):
        ledger.forget_indexed()
        remarks.append("the index was missing, damaged or of another version: it is rebuilt")
    return remarks
