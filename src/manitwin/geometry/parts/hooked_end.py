"""Distinguish the hooked end of an elongated object, such as the crook of an umbrella, from the straight one."""

from __future__ import annotations

import numpy as np

_SLICES = 32
_HOOK_SHARE = 0.15  # fraction of the length: region of an end that may be a hook
_MIDDLE_SHARE = 0.2  # fraction of the length: the shaft to either side of the middle
_BENT = 0.25  # of its width: offset of a hook's centre from the line of the shaft, which enters one side of it


def is_straight_end_last(share: np.ndarray, across_m: np.ndarray) -> bool | None:
    """Return whether the straight end, in line with the middle, comes last; None if neither end is bent, or both are.

    The line is fitted to the slices of the middle, because the box leans if one end extends to a side.
    """
    slices = [part for part in np.array_split(np.argsort(share, kind="stable"), _SLICES) if len(part)]
    at = np.array([share[part].mean() for part in slices])
    middles = np.array([(across_m[part].min(0) + across_m[part].max(0)) / 2 for part in slices])
    inner = np.abs(at - 0.5) < _MIDDLE_SHARE
    if np.count_nonzero(inner) < 2:
        return None
    slope, start = np.polyfit(at[inner], middles[inner], 1)
    bent = []
    for part in (share < _HOOK_SHARE, share > 1 - _HOOK_SHARE):
        end = across_m[part] - start - share[part, None] * slope
        bent.append(bool(np.linalg.norm(end.min(0) + end.max(0)) / 2 > _BENT * np.ptp(end, axis=0).max()))
    return bent[0] if bent[0] != bent[1] else None
