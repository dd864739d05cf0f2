"""Message about a path that does not exist."""

from __future__ import annotations

import re

_URL = re.compile(r"[a-z][a-z0-9+.-]+:/", re.IGNORECASE)  # a URL that was parsed as a path has a single slash


def missing_path_message(path: str) -> str:
    """Return why a path given by the user does not exist, with a hint if it is a URL."""
    if _URL.match(path):
        return "a URL; URLs are not downloaded: download the file, and give its path"
    return "not found"
