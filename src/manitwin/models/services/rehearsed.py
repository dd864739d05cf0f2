"""Note whether a rehearsal server (``manitwin fake``) gave an answer."""

from __future__ import annotations

import httpx2

from manitwin.engine.charges import REHEARSAL_MARK, note_rehearsal


def note_rehearsal_answer(response: httpx2.Response) -> None:
    """Note a rehearsal's answer by its header: an event hook of HTTP clients."""
    if REHEARSAL_MARK in response.headers:
        note_rehearsal()
