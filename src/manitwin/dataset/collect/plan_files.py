"""Write a collection plan as manifests that ``manitwin build`` reads."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path

from manitwin.dataset.collect.planning import CollectPlan
from manitwin.formats.output_folder import require_writable_folder
from manitwin.pipeline.mask_matching import masks_beside_photos
from manitwin.twin.import_record import IMPORTED_MESH
from manitwin.twin.store import write_bytes_atomically

MANIFEST, PROMPTS, SUMMARY = "manifest.csv", "prompts.csv", "plan.json"
_COLUMNS = ("file", "name", "license", "attribution")
_MASK = "mask"
"""Additional column if any photo of the plan has a mask file."""


def write_plan(plan: CollectPlan, folder: Path) -> list[Path]:
    """Write ``manifest.csv`` (chosen inputs), ``prompts.csv`` (prompts for missing inputs) and ``plan.json``; return their paths.

    Both tables are manifests: ``manitwin build FOLDER/manifest.csv -o DATASET``. Raises UsageError if the folder is not writable.
    """
    require_writable_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    masks = masks_beside_photos([Path(row.place) for row in plan.chosen if row.kind == "image"])
    built = [
        (
            str(Path(row.place, IMPORTED_MESH)) if row.kind == "asset" else row.place,
            row.name or row.category, row.licence, row.attribution or "",
            *([str(masks.get(Path(row.place), ""))] if masks else []),
        )
        for row in plan.chosen
    ]  # fmt: skip
    prompts = [(prompt.text, prompt.category) for prompt in plan.prompts]
    summary = {
        "items": plan.items,
        "chosen": len(plan.chosen),
        "prompts": len(plan.prompts),
        "groups": {name: {"wanted": plan.wanted[name], "there": plan.there[name]} for name in plan.wanted},
        "left_out": plan.left_out,
    }
    files = {
        MANIFEST: _table((*_COLUMNS, _MASK) if masks else _COLUMNS, built),
        PROMPTS: _table(("text", "name"), prompts),
        SUMMARY: json.dumps(summary, indent=1) + "\n",
    }
    for name, text in files.items():
        write_bytes_atomically(folder / name, text.encode())
    return [folder / name for name in files]


def _table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue()
