"""What is done with one asset of others is done in a process with limits: it may hang, swell or crash, and costs itself alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from manitwin.errors import AssetError
from manitwin.formats.isolated import Limits, ProcessCrashed, TookTooLong, run_isolated

LIMITS = Limits(seconds=120.0, memory_bytes=8 << 30)
"""Of one asset, whatever is done with it: reading, measuring, writing what is imported."""


def within_limits(function: str, path: Path, *arguments: Any) -> Any:
    """Return what ``package.module:function`` returns for an asset; AssetError too where it does not end as it should."""
    try:
        return run_isolated(function, path, *arguments, limits=LIMITS)
    except (ProcessCrashed, MemoryError) as error:
        raise AssetError(f"{path}: {why_ended(error)}") from error


def why_ended(error: Exception) -> str:
    """Return in words why the work on an asset has not ended as it should."""
    if isinstance(error, TookTooLong | TimeoutError):
        return f"reading it takes longer than {LIMITS.seconds:g} s; simplify it, or leave it out"
    if isinstance(error, MemoryError):
        return f"reading it takes more than {LIMITS.memory_bytes >> 30} GiB of memory; simplify it, or leave it out"
    return "it is so broken that the process which read it ended; export it again, or leave it out"
