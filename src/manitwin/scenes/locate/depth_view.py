"""One view of a depth camera: depths, optional colours, and pixel rays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.errors import UsageError
from manitwin.render.cameras import Camera

LEAST_PX = 80
"""Fewer pixels with a depth show no shape (a 7 cm can at 2 m, with a 40 degree lens and 480 rows, has 700)."""
PART_OF_JUMP = 0.1
"""Metres: larger second differences are object edges and say nothing about the noise."""
_OF_SECOND_DIFFERENCE = 1.4826 / np.sqrt(6.0)
"""Factor from the median absolute second difference of a plane with white noise to the noise's standard deviation."""
MOST_ROUNDING_M = 0.003
"""Standard deviation for steps of a centimetre; coarser depths cannot distinguish hand-sized objects."""


@dataclass(frozen=True)
class DepthView:
    """A view: ``depth_m (H, W)`` along the viewing axis, 0 unknown, inf nothing there; ``rgb (H, W, 3) uint8`` or None.

    Camera frame: x right, y down, z forward (OpenCV). In ``intrinsics (3, 3)``, the centre of the upper left pixel is (0.5,
    0.5). Depths are whole multiples of ``step_m``; 0: they are not rounded.
    """

    depth_m: np.ndarray
    intrinsics: np.ndarray
    rgb: np.ndarray | None = None
    step_m: float = 0.0

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Return the directions ``(N, 3)`` through the centres of pixels ``(N,)``, in row-major order, with z = 1."""
        rows, columns = np.divmod(pixels, self.depth_m.shape[1])
        k = self.intrinsics
        y = (rows + 0.5 - k[1, 2]) / k[1, 1]
        x = (columns + 0.5 - k[0, 2] - k[0, 1] * y) / k[0, 0]
        return np.stack([x, y, np.ones_like(x)], 1)

    def points(self, pixels: np.ndarray) -> np.ndarray:
        """Return the points ``(N, 3)``, m, at pixels ``(N,)``."""
        return np.asarray(self.rays(pixels) * self.depth_m.ravel()[pixels, None])

    def project(self, points_m: np.ndarray) -> np.ndarray:
        """Return the picture coordinates ``(N, 2)`` of points ``(N, 3)`` in front of the camera."""
        seen = points_m @ self.intrinsics.T
        return np.asarray(seen[:, :2] / seen[:, 2:])


def view_of_camera(camera: Camera, depth_m: np.ndarray, rgb: np.ndarray | None = None) -> DepthView:
    """Return the view of a renderer camera, in the frame with z forward."""
    focal_px = camera.focal_px
    intrinsics = np.array([[focal_px, 0, camera.width_px / 2], [0, focal_px, camera.height_px / 2], [0, 0, 1.0]])
    return DepthView(depth_m, intrinsics, rgb)


def known_depth(view: DepthView) -> np.ndarray:
    """Return which pixels have a finite known depth, ``(H, W) bool``."""
    return np.asarray((view.depth_m > 0) & np.isfinite(view.depth_m))


def measured_noise_m(view: DepthView, mask: np.ndarray) -> float:
    """Return the standard deviation (m) of the depth noise within ``mask (H, W) bool``, from second differences.

    A surface bends little between neighbouring pixels, while noise is independent. The result is at least the rounding error,
    because with coarse steps most neighbours are equal. Raises UsageError if there are too few runs of three pixels with a
    depth.
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
