"""Where a user's own files lie that programs may make again (XDG Base Directory Specification)."""

from __future__ import annotations

import os
from pathlib import Path


def cache_home() -> Path:
    """Return ``$XDG_CACHE_HOME/manitwin``, ``~/.cache/manitwin`` by default; a relative path counts as none, as specified.

    Raises RuntimeError where the user has no home either.
    """
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".cache") / "manitwin"
