"""Image layers: visible edges of a mesh, and a soft shadow on the ground."""

from __future__ import annotations

import cv2
import numpy as np
import trimesh

from manitwin.geometry.sampling import sample_surface
from manitwin.render.cameras import Camera, pixel_rays, project

_FINE = 3  # lines are rasterized at this resolution factor, one fine pixel wide
_DEPTH_SLACK = 0.012  # fraction of the mesh's diagonal: the depth image is coarser than the lines
_GRID = 192
_SAMPLES = 20_000
_STRENGTH, _MOST = 0.38, 0.6


def visible_edges(mesh: trimesh.Trimesh, camera: Camera, depth: np.ndarray) -> np.ndarray:
    """Return the coverage of each pixel by the mesh's visible edges, ``(H, W) float32``.

    ``depth (H, W)`` is the mesh's depth image, 0 for no surface. An edge is drawn if one of its faces is front-facing and the
    edge is no deeper than the depth image.
    """
    facing = ((mesh.triangles_center - camera.position) * mesh.face_normals).sum(1) < 0
    ends = np.sort(mesh.faces[facing][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    # one integer per edge sorts much faster than rows
    edges = np.stack(np.divmod(np.unique(ends[:, 0] * len(mesh.vertices) + ends[:, 1]), len(mesh.vertices)), axis=1)
    pixels, z = project(np.asarray(mesh.vertices), camera)
    length = np.linalg.norm(pixels[edges[:, 0]] - pixels[edges[:, 1]], axis=1)
    count = np.ceil(length * _FINE).astype(int) + 1
    edge = np.repeat(np.arange(len(edges)), count)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    along = (step / count[edge])[:, None]
    a, b = edges[edge].T
    point = pixels[a] * (1 - along) + pixels[b] * along
    point_depth = 1 / ((1 - along[:, 0]) / z[a] + along[:, 0] / z[b])  # 1/depth is linear along a line in the image
    height, width = depth.shape
    inside = ((point >= 0) & (point < [width, height])).all(1)
    point, point_depth = point[inside], point_depth[inside]
    x, y = point.astype(int).T
    slack = _DEPTH_SLACK * float(np.linalg.norm(mesh.extents))
    seen = (depth[y, x] == 0) | (point_depth < depth[y, x] + slack)
    fine = np.zeros((height * _FINE, width * _FINE), dtype=np.float32)
    fx, fy = (point[seen] * _FINE).astype(int).T
    fine[fy, fx] = 1
    return fine.reshape(height, _FINE, width, _FINE).mean((1, 3))


def ground_shadow(mesh: trimesh.Trimesh, camera: Camera) -> np.ndarray:
    """Return a factor ``(H, W) float32`` for the image of the plane z = 0 under a mesh lit by a wide sky.

    The shadow is sharper and darker where the surface is closer to the ground; 1 where the ground is not visible.
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
    """Return the occupied grid cells with small gaps closed, blurred."""
    layer = np.zeros((_GRID, _GRID), dtype=np.float32)
    layer[y, x] = 1
    layer = np.asarray(cv2.morphologyEx(layer, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)))
    return np.asarray(cv2.GaussianBlur(layer, (0, 0), blur))
