"""Machine-readable report of an import."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from manitwin.assets.importers.importer import Imported, kept_properties
from manitwin.formats.installation import installed_version


def report_of(every: Sequence[Imported]) -> str:
    """Return JSON with, for each asset in order, its folder, what was kept, what is missing, and what was dropped and why."""
    content = {
        "manitwin_version": installed_version(),
        "summary": {
            "imported": sum(each.record is not None and not each.there_already for each in every),
            "imported_before": sum(each.there_already for each in every),
            "not_imported": sum(each.record is None for each in every),
        },
        "assets": [_entry(each) for each in every],
    }
    return json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _entry(each: Imported) -> dict[str, Any]:
    if each.record is None or each.folder is None:
        return {"asset": str(each.path), "folder": None, "error": each.error}
    record = each.record
    return {
        "asset": str(each.path),
        "folder": each.folder.name,
        "imported_before": each.there_already,
        "format": record.format,
        "kept": kept_properties(record),
        "missing": record.missing,
        "dropped": record.dropped,
        "remarks": record.remarks,
    }
