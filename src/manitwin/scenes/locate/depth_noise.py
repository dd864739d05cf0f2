"""Noise model of a depth camera: depth noise that grows with distance, edge jitter, and missing depths."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np


@dataclass(frozen=True)
class DepthNoise:
    """The errors of a structured-light or time-of-flight camera.

    The standard deviation is ``base_m + growth_per_m * (z - nearest_m)^2`` along the viewing axis, with a lateral jitter of
    ``jitter_px``: Nguyen, Izadi and Lovell 2012 ("Modeling Kinect Sensor Noise for Improved 3D Reconstruction and Tracking",
    equations 3 and 4, rounded). A share ``lost_at_jumps`` of the pixels beside a depth jump and ``lost_anywhere`` of all have
    no depth.
    """

    base_m: float = 0.0012
    growth_per_m: float = 0.0019
    nearest_m: float = 0.4
    jitter_px: float = 0.5
    lost_at_jumps: float = 0.3
    lost_anywhere: float = 0.01
    jump_m: float = 0.02
    step_m: float = 0.001

    def sigma_m(self, depth_m: np.ndarray) -> np.ndarray:
        """Return the standard deviation at each depth."""
        return np.asarray(self.base_m + self.growth_per_m * np.maximum(depth_m - self.nearest_m, 0.0) ** 2)

    def simulate_depth(self, depth_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return true depths ``(H, W)`` (0: nothing) as the camera measures them: multiples of ``step_m``, 0 unknown."""
        height, width = depth_m.shape
        rows, columns = np.mgrid[:height, :width]
        shift = rng.normal(0.0, self.jitter_px, (2, height, width))
        rows = np.clip(np.rint(rows + shift[0]), 0, height - 1).astype(int)
        columns = np.clip(np.rint(columns + shift[1]), 0, width - 1).astype(int)
        seen = depth_m[rows, columns]
        step = np.abs(cv2.Laplacian(seen, cv2.CV_64F)) > self.jump_m
        jump = cv2.dilate(step.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
        told = seen + rng.normal(0.0, 1.0, seen.shape) * self.sigma_m(seen)
        lost = (rng.random(seen.shape) < self.lost_anywhere) | (jump & (rng.random(seen.shape) < self.lost_at_jumps))
        told[lost | (seen == 0)] = 0.0
        return np.asarray(np.rint(told / self.step_m) * self.step_m)
