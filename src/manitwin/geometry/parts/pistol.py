"""Barrel, grip and working end of a pistol-shaped object, such as a drill or hair dryer, from its outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_CELLS = 40  # along the outline's longer side
_NEAR_PLANE = 0.8  # share of the surface used for fitting the plane of barrel and grip
_FITS = 10  # iterations of that fit
_LIKE_BOX = 0.97  # cosine between the plane's normal and a box axis above which the box axis is used
_STEPS = 72  # directions per turn in which the grip is sought
_ALONG_BOX = 1.1  # preference for the box's own directions
_BARREL_ROW = 0.7  # fraction of the longest row: rows this long cross the barrel
_GRIP_ROW = 0.55  # fraction of the longest row: largest median length of the rows beyond the barrel
_LEAST_GRIP = 0.25  # least share of the outline's rows beyond the barrel
# Share of the grip's upper rows that must be a single bar; the lever of a caulking gun is a second one beside its handle.
_ONE_RUN = 0.4
_GAP = 3  # cells that may be missing within a bar
_BACK = 2  # cells by which a straight back may be uneven
_LEAST_STRAIGHT = 0.55  # least straightness of a barrel
_OVERHANG = 0.1  # fraction of the barrel's length: overhang beyond the grip at its back
_PLACED, _BLUNT = 0.2, 0.3  # penalties for a grip at the very end, and for one that tapers to nothing
_END = 0.2  # fraction of the barrel's length: end regions compared for taper
_PLACE_WEIGHT, _TAPER_WEIGHT = 2.0, 1.0


@dataclass(frozen=True)
class Pistol:
    """A barrel with a transverse grip, in the plane of the outline.

    ``origin_m (3,)`` is the corner of the barrel's box at its working end, on the side away from the grip. ``along (3,)``
    points from there to its back, ``down (3,)`` towards the grip. ``length_m`` and ``barrel_m`` are the barrel's length and
    height, ``height_m`` is that of barrel and grip together; ``grip_share`` is the grip's position along the barrel.
    """

    origin_m: np.ndarray
    along: np.ndarray
    down: np.ndarray
    length_m: float
    barrel_m: float
    height_m: float
    grip_share: float

    def places(self, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates of points ``(N, 3)``: along the barrel (0 at the working end), and down, in heights of the
        barrel.
        """
        offset = points_m - self.origin_m
        return offset @ self.along / self.length_m, offset @ self.down / self.barrel_m


@dataclass(frozen=True)
class _Outline:
    """Measures of an outline's rows of cells, from the barrel's back downward: goodness of fit, and extent of barrel and grip."""

    fit: float
    barrel_rows: int
    first: int
    last: int
    grip_share: float
    front_is_last: bool


def find_pistol(surface_m: np.ndarray, obb_to_object: np.ndarray) -> Pistol | None:
    """Return barrel and grip from surface samples ``(N, 3)``; None if the object is not a thick bar with a thinner transverse
    one.

    The outline is taken in the plane near which most of the surface lies. Among all in-plane directions, the barrel lies along
    the one in which it is straightest: its back is even from end to end and it fills its box, whereas a grip with a battery at
    its end is hollow on both sides and leans. The working end is the one away from the grip, and the one that tapers.
    """
    center = surface_m.mean(0)
    axes, of_box = _plane(surface_m, obb_to_object[:3, :3].T)
    flat = (surface_m - center) @ axes.T
    cell_m = float(np.ptp(flat, axis=0).max()) / _CELLS
    best: tuple[float, _Outline, np.ndarray, np.ndarray] | None = None
    for step in range(_STEPS):
        angle = 2 * np.pi * step / _STEPS
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        turned = flat @ turn.T
        measured = _measured(_rows(turned, cell_m))
        if measured is not None:
            fit = measured.fit * (_ALONG_BOX if of_box and step % (_STEPS // 4) == 0 else 1.0)
            best = max(best or (0.0, measured, turn, turned), (fit, measured, turn, turned), key=lambda each: each[0])
    if best is None:
        return None
    _, found, turn, turned = best
    along, down = turn @ axes
    low = turned.min(0)
    front = low[0] + (found.last if found.front_is_last else found.first) * cell_m
    return Pistol(
        origin_m=center + along * front + down * low[1],
        along=-along if found.front_is_last else along,
        down=down,
        length_m=(found.last - found.first) * cell_m,
        barrel_m=found.barrel_rows * cell_m,
        height_m=float(np.ptp(turned[:, 1])),
        grip_share=1 - found.grip_share if found.front_is_last else found.grip_share,
    )


def _plane(surface_m: np.ndarray, box_axes: np.ndarray) -> tuple[np.ndarray, bool]:
    """Return two axes ``(2, 3)`` of the plane near which most points ``(N, 3)`` lie, and whether they are box axes.

    A drill's side handle sticks out of the plane, so that neither the shortest box side nor the direction of least variance
    need be its normal. Starting from each principal axis, the farthest points are left out and the plane is refitted; the
    thinnest result counts. A nearly parallel box is used instead, as it is exact where the fit is not.
    """
    found: list[tuple[float, np.ndarray]] = []
    for normal in np.linalg.eigh(np.cov(surface_m.T))[1].T:
        axes = normal[:, None]
        for _ in range(_FITS):
            away = surface_m @ axes[:, 0]
            away = np.abs(away - np.median(away))
            spread, axes = np.linalg.eigh(np.cov(surface_m[away <= np.quantile(away, _NEAR_PLANE)].T))
        found.append((float(spread[0]), axes.T))
    axes = min(found, key=lambda each: each[0])[1]
    across = np.abs(box_axes @ axes[0])
    nearest = int(across.argmax())
    return (np.delete(box_axes, nearest, 0), True) if across[nearest] > _LIKE_BOX else (axes[1:], False)


def _rows(flat_m: np.ndarray, cell_m: float) -> np.ndarray:
    """Return an occupancy grid of points ``(N, 2)``, with one row per step of the second coordinate."""
    # so that the farthest point falls into the last cell
    index = ((flat_m - flat_m.min(0)) / (cell_m * (1 + 1e-9))).astype(int)
    taken = np.zeros(index.max(0)[::-1] + 1, dtype=bool)
    taken[index[:, 1], index[:, 0]] = True
    return taken


def _measured(rows: np.ndarray) -> _Outline | None:
    """Measure an outline ``(R, C)`` under the assumption that its barrel lies along the first rows."""
    lengths = rows.sum(1)
    longest = int(lengths.argmax())
    if longest > len(rows) / 2:
        return None
    barrel_rows = longest + 1
    while barrel_rows < len(rows) and lengths[barrel_rows] >= _BARREL_ROW * lengths[longest]:
        barrel_rows += 1
    grip = rows[barrel_rows:]
    if len(grip) < _LEAST_GRIP * len(rows) or np.median(grip.sum(1)) > _GRIP_ROW * lengths[longest]:
        return None
    halfway = (lengths[longest] + float(np.median(grip.sum(1)))) / 2
    while lengths[barrel_rows] >= halfway:  # the lower side of a round barrel
        barrel_rows += 1
    grip = rows[barrel_rows:]
    columns = np.flatnonzero(rows[:barrel_rows].any(0))
    first, last = int(columns[0]), int(columns[-1]) + 1
    barrel = rows[:barrel_rows, first:last]
    straight = float(barrel[: _BACK + 1].any(0).mean() * barrel.mean())
    upper = grip[: max(len(grip) // 2, 1)]  # below, a drill's battery extends forward
    if straight < _LEAST_STRAIGHT or np.mean([_is_one_run(row) for row in upper]) < _ONE_RUN:
        return None
    grip_at = float(np.nonzero(upper)[1].mean()) + 0.5
    share = (grip_at - first) / (last - first)
    heights = barrel.sum(0)
    count = max(round(_END * len(heights)), 1)
    low, high = float(heights[:count].mean()), float(heights[-count:].mean())
    forward = _PLACE_WEIGHT * (0.5 - share) + _TAPER_WEIGHT * (low - high) / max(low, high, 1.0)
    fit = straight * _like_a_grip(grip, upper, first, last)
    return _Outline(fit, barrel_rows, first, last, share, forward > 0)


def _like_a_grip(grip: np.ndarray, upper: np.ndarray, first: int, last: int) -> float:
    """Score how grip-like the rows beyond a barrel are, up to 1: less tapered than a chuck, and not at the very end."""
    taken = [np.flatnonzero(row) for row in upper if row.any()]
    before = float(np.median([row[0] for row in taken])) - first
    behind = last - 1 - float(np.median([row[-1] for row in taken]))
    overhang = min(before, behind) / (last - first)
    end = np.mean([_widest_run(row) for row in grip[-max(len(grip) // 4, 1) :]])
    blunt = float(end / np.median([_widest_run(row) for row in upper]))
    return (1 - _PLACED * (1 - np.clip(overhang / _OVERHANG, 0, 1))) * (1 - _BLUNT * (1 - np.clip(blunt, 0, 1)))


def _is_one_run(row: np.ndarray) -> bool:
    taken = np.flatnonzero(row)
    return len(taken) > 0 and int(np.diff(taken).max(initial=0)) <= _GAP


def _widest_run(row: np.ndarray) -> int:
    ends = np.flatnonzero(np.diff(row.astype(int), prepend=0, append=0))
    return int((ends[1::2] - ends[::2]).max(initial=0))
