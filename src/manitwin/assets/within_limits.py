"""Processing of one untrusted asset in an isolated process, so that a hang, crash or memory blow-up affects it alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from manitwin.errors import AssetError
from manitwin.formats.isolated import Limits, ProcessCrashed, ProcessTimeout, run_isolated

LIMITS = Limits(seconds=120.0, memory_bytes=8 << 30)
"""Limits of any single operation on one asset: reading, measuring or importing it."""


def run_within_limits(function: str, path: Path, *arguments: Any) -> Any:
    """Run ``package.module:function`` on an asset in an isolated process and return its result.

    Raises AssetError also where the process exceeds its limits or crashes.
    """
    try:
        return run_isolated(function, path, *arguments, limits=LIMITS)
    except (ProcessCrashed, MemoryError) as error:
        raise AssetError(f"{path}: {termination_cause(error)}") from error


def termination_cause(error: Exception) -> str:
    """Describe why the processing of an asset ended abnormally, with a remedy."""
    if isinstance(error, ProcessTimeout | TimeoutError):
        return f"reading it takes longer than {LIMITS.seconds:g} s; simplify it, or leave it out"
    if isinstance(error, MemoryError):
        return f"reading it takes more than {LIMITS.memory_bytes >> 30} GiB of memory; simplify it, or leave it out"
    return "it is so broken that the process which read it ended; export it again, or leave it out"
