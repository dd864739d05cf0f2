"""Downsampling of recordings, for policies that act less often, and for cheaper pictures."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from manitwin.episodes.recording import RATE_HZ, Recording
from manitwin.episodes.recording_arrays import is_per_action
from manitwin.errors import EpisodesError, UsageError, unknown_name_message

RATES_HZ = (RATE_HZ, 10, 5)
_OF_FRAMES = ("phase", "active_literal")
"""Per-action values that belong to the start of the action."""


def rows_per_frame(rate_hz: int) -> int:
    """Return the number of recorded rows per frame at ``rate_hz``; raises UsageError for a rate not in ``RATES_HZ``."""
    if isinstance(rate_hz, bool) or rate_hz not in RATES_HZ:
        raise UsageError(unknown_name_message("rate", str(rate_hz), [str(each) for each in RATES_HZ]))
    return RATE_HZ // int(rate_hz)


def downsample(recording: Recording, rate_hz: int) -> Recording:
    """Return a recording as if made at ``rate_hz``: every k-th state, and the actions that lead to them.

    Action i is the command for state i + 1, which is the last one given before it. Incomplete frames at the end, at most k -
    1 rows, are dropped; kept episodes end with half a second of rest. Raises UsageError as ``rows_per_frame``, EpisodesError
    for a recording shorter than a frame.
    """
    every = rows_per_frame(rate_hz)
    if every == 1:
        return recording
    count = recording.steps // every
    if count == 0:
        raise EpisodesError(f"{recording.steps} steps are less than one at {rate_hz} Hz; take a higher rate")
    thinned: dict[str, Any] = {}
    for entry in fields(Recording):
        array = getattr(recording, entry.name)
        if not isinstance(array, np.ndarray):
            continue
        if entry.name in _OF_FRAMES:
            thinned[entry.name] = array[: count * every : every]
        elif is_per_action(entry.name):
            thinned[entry.name] = array[every - 1 : count * every : every]
        else:
            thinned[entry.name] = array[: count * every + 1 : every]
    since = recording.unplanned_contact[1 : count * every + 1].reshape(count, every)
    thinned["unplanned_contact"] = np.append(recording.unplanned_contact[:1], since.any(1))
    return replace(recording, **thinned)
