"""Hear from an answer whether a rehearsal server (``manitwin fake``) gave it."""

from __future__ import annotations

import httpx2

from manitwin.charges import REHEARSAL_MARK, note_rehearsal


def hear(response: httpx2.Response) -> None:
    """Note a rehearsal's answer by its header: an event hook of HTTP clients."""
    if REHEARSAL_MARK in response.headers:
        note_rehearsal()
