"""The edges of a mesh that a camera sees, as a picture."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.render.cameras import Camera, project

_FINE = 3  # lines are put down on a raster this many times finer each way, one fine pixel wide
_DEPTH_SLACK = 0.012  # of the mesh's diagonal: the depth picture is coarser than the lines


def visible_edges(mesh: trimesh.Trimesh, camera: Camera, depth: np.ndarray) -> np.ndarray:
    """Return how much of each pixel the mesh's visible edges cover, ``(H, W) float32``.

    ``depth (H, W)`` is the mesh's own, 0 where nothing is. An edge is drawn where one of its faces turns to the camera
    and it lies no deeper than the depth picture says.
    """
    facing = ((mesh.triangles_center - camera.position) * mesh.face_normals).sum(1) < 0
    edges = np.unique(np.sort(mesh.faces[facing][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    pixels, z = project(np.asarray(mesh.vertices), camera)
    length = np.linalg.norm(pixels[edges[:, 0]] - pixels[edges[:, 1]], axis=1)
    count = np.ceil(length * _FINE).astype(int) + 1
    edge = np.repeat(np.arange(len(edges)), count)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    along = (step / count[edge])[:, None]
    a, b = edges[edge].T
    point = pixels[a] * (1 - along) + pixels[b] * along
    point_depth = 1 / ((1 - along[:, 0]) / z[a] + along[:, 0] / z[b])  # 1/depth is linear along a picture's line
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
