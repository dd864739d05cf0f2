"""What is said of a path that leads to nothing."""

from __future__ import annotations

import re

_URL = re.compile(r"[a-z][a-z0-9+.-]+:/", re.IGNORECASE)  # what was read as a path has a single slash


def not_there(path: str) -> str:
    """Return why nothing is found at a path that a person gave: it is not there, or no path but a URL."""
    if _URL.match(path):
        return "a URL; URLs are not downloaded: download the file, and give its path"
    return "not found"
