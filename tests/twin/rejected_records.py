"""A record of an input that was rejected: the shortest one that is whole."""

from __future__ import annotations

from typing import Any


def rejected_record() -> dict[str, Any]:
    """Return the content of a twin.json, not sealed."""
    return {
        "twin_id": "abc",
        "name": None,
        "status": "rejected",
        "rejection": {"stage": "input", "reason": "empty", "detail": "nothing in it"},
        "source": {"kind": "image", "file": "source.png", "sha256": "0", "license": "unknown"},
        "provenance": {"manitwin_version": "0", "config_sha256": "0", "seed": 0, "stages": {}},
        "quality": {"checks": []},
    }
