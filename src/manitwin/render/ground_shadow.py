"""The soft shade of an object on the ground that it stands on."""

from __future__ import annotations

import cv2
import numpy as np
import trimesh

from manitwin.geometry.sampling import sample_surface
from manitwin.render.cameras import Camera, pixel_rays

_GRID = 192
_SAMPLES = 20_000
_STRENGTH, _MOST = 0.38, 0.6


def ground_shadow(mesh: trimesh.Trimesh, camera: Camera) -> np.ndarray:
    """Return a factor ``(H, W) float32`` for the picture of the plane z = 0 under a mesh, lit by a wide sky.

    The nearer a surface is to the ground, the sharper and darker its shade; 1 where the camera does not see the ground.
    """
    points, _, _ = sample_surface(mesh, _SAMPLES, np.random.default_rng(0))
    low, high = mesh.bounds
    size, middle = 2.2 * float((high - low).max()), (low + high)[:2] / 2
    cells = ((points[:, :2] - middle) / size + 0.5) * _GRID
    x, y = np.clip(cells.astype(int), 0, _GRID - 1).T
    height = np.clip((points[:, 2] - low[2]) / float((high - low).max()), 0, 1)
    touching = height < 0.06
    shade = 0.6 * _blurred_footprint(x[touching], y[touching], 2.0) + 0.75 * _blurred_footprint(x, y, 9.0)
    origins, directions = pixel_rays(camera)
    down = directions[:, 2] < -1e-6
    reach = np.where(down, (low[2] - origins[:, 2]) / np.where(down, directions[:, 2], -1.0), 0.0)
    ground = ((origins + directions * reach[:, None])[:, :2] - middle) / size + 0.5
    at = (ground * _GRID - 0.5).astype(np.float32).reshape(camera.height_px, camera.width_px, 2)
    seen = cv2.remap(shade, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
    return (1 - np.where(down.reshape(seen.shape), np.minimum(_STRENGTH * seen, _MOST), 0)).astype(np.float32)


def _blurred_footprint(x: np.ndarray, y: np.ndarray, blur: float) -> np.ndarray:
    """Return the grid's cells that hold points, small gaps closed, blurred."""
    layer = np.zeros((_GRID, _GRID), dtype=np.float32)
    layer[y, x] = 1
    layer = np.asarray(cv2.morphologyEx(layer, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)))
    return np.asarray(cv2.GaussianBlur(layer, (0, 0), blur))
