"""Detection of arches with two heavy ends, such as headphones, in any pose: position of apex and ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_LOPSIDED = 0.03  # fraction of the length: least offset of the centre of mass from the box centre, towards the ends


@dataclass(frozen=True)
class Arch:
    """The frame of an arch: ``origin_m (3,)`` is the box centre, ``apex (3,)`` points to the apex, ``apart (3,)`` from one end to
    the other.

    ``half_m`` are the half lengths (m) in both directions.
    """

    origin_m: np.ndarray
    apex: np.ndarray
    apart: np.ndarray
    half_m: tuple[float, float]

    def places(self, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return normalized coordinates of points ``(N, 3)``: from the ends (-1) to the apex (1), and from one end (-1) to the
        other (1).
        """
        offset = points_m - self.origin_m
        return offset @ self.apex / self.half_m[0], offset @ self.apart / self.half_m[1]

    def near_apex(self, points_m: np.ndarray) -> np.ndarray:
        """Score the proximity of points ``(N, 3)`` to the apex, in [0, 1]."""
        towards, across = self.places(points_m)
        return _falling(1 - towards, 0.2) * (0.6 + 0.4 * _falling(across, 0.4))

    def near_ends(self, points_m: np.ndarray) -> np.ndarray:
        """Score the proximity of points ``(N, 3)`` to the outside of either end, in [0, 1]."""
        towards, across = self.places(points_m)
        return _falling(towards + 0.5, 0.35) * _falling(np.maximum(0.8 - np.abs(across), 0), 0.2)


def find_arch(
    surface_m: np.ndarray, obb_extents_m: np.ndarray, obb_to_object: np.ndarray, center_of_mass_m: np.ndarray
) -> Arch | None:
    """Return the arch of an object from surface samples ``(N, 3)``, its oriented box and its centre of mass.

    The apex is on the side away from the centre of mass. The ends lie apart along the axis in which the heavy half is emptiest
    in the middle. None if the centre of mass is at the centre of the box.
    """
    axes, half = obb_to_object[:3, :3].T, obb_extents_m / 2
    origin = obb_to_object[:3, 3]
    off = axes @ (center_of_mass_m - origin) / np.maximum(half, 1e-9)
    first = int(np.abs(off).argmax())
    if abs(off[first]) < 2 * _LOPSIDED:
        return None
    apex = -np.sign(off[first]) * axes[first]
    heavy = (surface_m - origin) @ apex < 0
    others = [each for each in range(3) if each != first]
    spread = [float(np.abs((surface_m[heavy] - origin) @ axes[each]).mean() / max(half[each], 1e-9)) for each in others]
    second = others[int(np.argmax(spread))]
    return Arch(origin, apex, axes[second], (float(half[first]), float(half[second])))


def _falling(distance: np.ndarray, width: float) -> np.ndarray:
    return np.asarray(np.exp(-0.5 * (distance / width) ** 2))
