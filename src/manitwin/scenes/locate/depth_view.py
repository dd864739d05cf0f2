"""One view of a depth camera: depths, optional colours, and the rays of its pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.errors import UsageError
from manitwin.render.cameras import Camera

LEAST_PX = 80
"""Fewer pixels with a depth show no shape (a can of 7 cm at 2 m, seen by a lens of 40 degrees on 480 rows, has 700)."""
PART_OF_JUMP = 0.1
"""Metres: second differences above it are edges of things and tell nothing of the noise."""
_OF_SECOND_DIFFERENCE = 1.4826 / np.sqrt(6.0)
"""Median absolute second difference of a plane with white noise to the noise's standard deviation."""
MOST_ROUNDING_M = 0.003
"""The standard deviation of steps of a centimetre: of coarser ones no thing of a hand's size is told from another."""


@dataclass(frozen=True)
class DepthView:
    """``depth_m (H, W)`` along the viewing axis: 0 unknown, inf nothing there. ``rgb (H, W, 3) uint8`` or None.

    Camera frame: x right, y down, z ahead (OpenCV's). ``intrinsics (3, 3)`` count pixels so that the centre of the upper left one
    is (0.5, 0.5). Depths are whole multiples of ``step_m``; 0: they are not rounded.
    """

    depth_m: np.ndarray
    intrinsics: np.ndarray
    rgb: np.ndarray | None = None
    step_m: float = 0.0

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Return the directions ``(N, 3)`` through the centres of pixels ``(N,)``, counted row by row, with z = 1."""
        rows, columns = np.divmod(pixels, self.depth_m.shape[1])
        k = self.intrinsics
        y = (rows + 0.5 - k[1, 2]) / k[1, 1]
        x = (columns + 0.5 - k[0, 2] - k[0, 1] * y) / k[0, 0]
        return np.stack([x, y, np.ones_like(x)], 1)

    def points(self, pixels: np.ndarray) -> np.ndarray:
        """Return the points ``(N, 3)``, m, that pixels ``(N,)`` show."""
        return np.asarray(self.rays(pixels) * self.depth_m.ravel()[pixels, None])

    def project(self, points_m: np.ndarray) -> np.ndarray:
        """Return the places ``(N, 2)`` in the picture of points ``(N, 3)`` before the camera."""
        seen = points_m @ self.intrinsics.T
        return np.asarray(seen[:, :2] / seen[:, 2:])


def view_of_camera(camera: Camera, depth_m: np.ndarray, rgb: np.ndarray | None = None) -> DepthView:
    """Return what a camera of the renderer sees, in the frame with z ahead."""
    focal_px = camera.focal_px
    intrinsics = np.array([[focal_px, 0, camera.width_px / 2], [0, focal_px, camera.height_px / 2], [0, 0, 1.0]])
    return DepthView(depth_m, intrinsics, rgb)


def known_depth(view: DepthView) -> np.ndarray:
    """Return where something is seen at a known depth, ``(H, W) bool``."""
    return np.asarray((view.depth_m > 0) & np.isfinite(view.depth_m))


def measured_noise_m(view: DepthView, mask: np.ndarray) -> float:
    """Return the standard deviation (m) of the depth noise on what ``mask (H, W) bool`` shows, from second differences.

    A surface bends little from one pixel to the next, noise does not know its neighbour. It is no less than what rounding makes:
    of coarse steps most neighbours are the same. Raises UsageError where no three pixels in a row have a depth.
    """
    known = known_depth(view) & mask
    depth = np.where(known, view.depth_m, 0.0)
    apart: list[np.ndarray] = []
    for z, k in ((depth, known), (depth.T, known.T)):
        three = k[:, :-2] & k[:, 1:-1] & k[:, 2:]
        second = np.abs(z[:, :-2] - 2 * z[:, 1:-1] + z[:, 2:])[three]
        apart.append(second[second < PART_OF_JUMP])
    told = np.concatenate(apart)
    if len(told) < 10:
        raise UsageError(
            f"the mask has {int(known.sum())} pixels with a depth, but too few adjacent ones; give a mask of one"
            f" object in the depth image"
        )
    rounding_m = min(view.step_m / np.sqrt(12.0), MOST_ROUNDING_M)
    return max(float(_OF_SECOND_DIFFERENCE * np.median(told)), float(rounding_m))
