"""Folders for a user's files that can be created again (XDG Base Directory Specification)."""

from __future__ import annotations

import os
from pathlib import Path


def cache_home() -> Path:
    """Return ``$XDG_CACHE_HOME/manitwin``, or ``~/.cache/manitwin`` if the variable is not an absolute path, as specified.

    Raises RuntimeError if the user has no home folder either.
    """
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".cache") / "manitwin"
