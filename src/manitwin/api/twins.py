"""Load and export a finished twin; get the JSON schema of its record."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from manitwin.twin.loaded_twin import Twin


def load(folder: str | Path, verify: bool = False) -> Twin:
    """Load a finished twin; with ``verify``, check the SHA-256 digest of every file. Raises TwinError."""
    from manitwin.twin.loaded_twin import Twin

    return Twin(folder, verify=verify)


def export_twin(
    twin: Twin | str | Path, to: str | Iterable[str], out: str | Path, *, license_allow: Iterable[str] | None = None
) -> dict[str, Path]:
    """Export a twin to one or more formats (``"mjcf"``, ``["urdf", "usd"]``, ``"all"``) below ``out``; return the main file of
    each.

    Raises UsageError for an unknown format, and ExportError for a licence not in ``license_allow`` or a twin that a format
    cannot represent.
    """
    from manitwin.assets.writers.exporter import TwinContent
    from manitwin.assets.writers.registry import chosen_formats
    from manitwin.assets.writers.write import export_twin as write
    from manitwin.twin.loaded_twin import Twin

    content = TwinContent.of(twin if isinstance(twin, Twin) else Twin(twin))
    formats = chosen_formats([to] if isinstance(to, str) else to)
    return {name: write(content, name, out, license_allow=license_allow) for name in formats}


def schema() -> dict[str, Any]:
    """Return the JSON Schema of twin.json."""
    from manitwin.twin.record import TwinRecord

    return TwinRecord.model_json_schema()
