"""Tell the barrel, the grip and the working end of a pistol-shaped thing, such as a drill or a hair dryer, by its outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_CELLS = 40  # along the longer side of the outline
_BARREL_ROW = 0.7  # of the longest row: a row that long crosses the barrel
_GRIP_ROW = 0.55  # of the longest row: rows beyond the barrel are that short in the median, else it is no pistol
_LEAST_GRIP = 0.25  # of the outline across the barrel
_ONE_RUN = 0.8  # of the grip's upper rows: so many are one bar
_GAP = 3  # cells that may be missing in a bar
_END = 0.2  # of the barrel: what is compared to tell how its ends taper
_PLACE_WEIGHT, _TAPER_WEIGHT = 2.0, 1.0


@dataclass(frozen=True)
class Pistol:
    """A barrel with a grip across it, in the plane of the outline.

    ``origin_m (3,)`` is the corner of the barrel's box at its working end on the side away from the grip; ``along (3,)`` leads
    from there to its back, ``down (3,)`` towards the grip. ``length_m`` is the barrel's, ``barrel_m`` its height, ``height_m``
    that of barrel and grip; ``grip_share`` is where along the barrel the grip is.
    """

    origin_m: np.ndarray
    along: np.ndarray
    down: np.ndarray
    length_m: float
    barrel_m: float
    height_m: float
    grip_share: float

    def places(self, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where points ``(N, 3)`` are: along the barrel (0 at the working end), and down, in heights of the barrel."""
        offset = points_m - self.origin_m
        return offset @ self.along / self.length_m, offset @ self.down / self.barrel_m


def find_pistol(surface_m: np.ndarray, obb_extents_m: np.ndarray, obb_to_object: np.ndarray) -> Pistol | None:
    """Return the barrel and grip of surface samples ``(N, 3)``, None for what is not a thick bar with a thinner one across.

    The outline is looked at across the box's shortest axis. The barrel lies along that side of it whose rows are long while the
    rows beyond are the shortest. Its working end is the one away from the grip, and the one that tapers.
    """
    order = np.argsort(-obb_extents_m, kind="stable")
    axes, extents = obb_to_object[:3, :3].T[order], obb_extents_m[order]
    flat = (surface_m - obb_to_object[:3, 3]) @ axes[:2].T + extents[:2] / 2
    cell_m = float(extents[0]) / _CELLS
    shape = np.maximum(np.ceil(extents[:2] / cell_m).astype(int), 1)
    taken = np.zeros(shape, dtype=bool)
    index = np.clip((flat / cell_m).astype(int), 0, shape - 1)
    taken[index[:, 0], index[:, 1]] = True
    found: list[tuple[float, Pistol]] = []
    for length_axis in (0, 1):
        for near_low in (True, False):
            outline = taken.T if length_axis == 0 else taken
            rows = outline if near_low else outline[::-1]
            measured = _measured(rows)
            if measured is None:
                continue
            ratio, barrel_rows, first, last, grip_share, front_is_last = measured
            along = -axes[length_axis] if front_is_last else axes[length_axis]
            down = axes[1 - length_axis] * (1 if near_low else -1)
            middle = obb_to_object[:3, 3] - down * extents[1 - length_axis] / 2
            front = (last * cell_m if front_is_last else first * cell_m) - extents[length_axis] / 2
            pistol = Pistol(
                origin_m=middle + axes[length_axis] * front,
                along=along,
                down=down,
                length_m=(last - first) * cell_m,
                barrel_m=barrel_rows * cell_m,
                height_m=float(extents[1 - length_axis]),
                grip_share=1 - grip_share if front_is_last else grip_share,
            )
            found.append((ratio, pistol))
    return min(found, key=lambda each: each[0])[1] if found else None


def _measured(rows: np.ndarray) -> tuple[float, int, int, int, float, bool] | None:
    """Measure an outline ``(R, C)`` whose barrel may lie along its first rows.

    Returns the median row of the grip by the longest row, how many rows the barrel has, its first and last column, where along
    it the grip is, and whether its working end is at the last column.
    """
    lengths = rows.sum(1)
    longest = int(lengths.argmax())
    if longest > len(rows) / 2:
        return None
    barrel_rows = longest + 1
    while barrel_rows < len(rows) and lengths[barrel_rows] >= _BARREL_ROW * lengths[longest]:
        barrel_rows += 1
    grip = rows[barrel_rows:]
    if len(grip) < _LEAST_GRIP * len(rows):
        return None
    ratio = float(np.median(grip.sum(1))) / float(lengths[longest])
    if ratio > _GRIP_ROW:
        return None
    barrel = rows[:barrel_rows]
    columns = np.flatnonzero(barrel.any(0))
    first, last = int(columns[0]), int(columns[-1]) + 1
    upper = grip[: max(len(grip) // 2, 1)]  # below it a drill's battery reaches forward
    if np.mean([_is_one_run(row) for row in upper]) < _ONE_RUN:
        return None  # between two bars: seen along the grip, a drill has its barrel on one side and its battery on the other
    grip_at = float(np.nonzero(upper)[1].mean()) + 0.5 if upper.any() else (first + last) / 2
    share = (grip_at - first) / (last - first)
    heights = barrel[:, first:last].sum(0)
    count = max(round(_END * len(heights)), 1)
    low, high = float(heights[:count].mean()), float(heights[-count:].mean())
    forward = _PLACE_WEIGHT * (0.5 - share) + _TAPER_WEIGHT * (low - high) / max(low, high, 1.0)
    return ratio, barrel_rows, first, last, share, forward > 0


def _is_one_run(row: np.ndarray) -> bool:
    taken = np.flatnonzero(row)
    return len(taken) > 0 and int(np.diff(taken).max(initial=0)) <= _GAP
