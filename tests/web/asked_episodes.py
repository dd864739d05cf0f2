"""Runs of episodes for the tests of their pages, and what the server gives of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from access_requests import asked

from drawn_episodes import recording, stored, write_run
from drawn_scenes import write_scenes
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.web.episode_document import DOCUMENT
from manitwin.web.serve import application_for_place


def get(place: Path, path: str, twins: str | None = None) -> tuple[int, bytes]:
    """Ask the pages of a place for a path; return the status and the body."""
    messages = asked(application_for_place(str(place), place.parent / "cache", twins), path)
    return messages[0]["status"], b"".join(each.get("body", b"") for each in messages[1:])


def document(place: Path, number: int = 0, twins: str | None = None) -> dict[str, Any]:
    """Return the document of an episode's page."""
    status, body = get(place, f"/episode/{number}/{DOCUMENT}", twins)
    assert status == 200, body
    return dict(json.loads(body))


def run_of(root: Path, **changes: Any) -> Path:
    """Write a run of one episode with other arrays, facts or fields of its attempt."""
    write_scenes(root)
    arrays = changes.pop("arrays", {})
    return write_run(root, [stored(root, 0, replace(recording(), **arrays), **changes)])


def stored_ones(root: Path, count: int) -> list[StoredEpisode]:
    """Return recorded episodes of one set of scenes."""
    write_scenes(root)
    return [stored(root, number) for number in range(count)]
