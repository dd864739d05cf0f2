"""Ray-cast images: exact depth, normals and faces, and visibility of points."""

from __future__ import annotations

import cv2
import numpy as np
import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import Camera, pixel_rays

ON_SURFACE_M = 0.001  # tolerance for a candidate on the visible surface (half of a twin's tolerance)
ON_SURFACE_SHARE = 0.01  # for small objects, this share of the longest side
FACING_COSINE = 0.05  # a surface seen at less than 3 degrees appears as a line


def cast_camera(caster: RayCaster, camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cast a ray through the centre of every pixel.

    Returns depth along the viewing axis ``(H, W)`` (0: no hit), unit normals of the hit faces in the object frame ``(H, W,
    3)``, and face indices ``(H, W)`` (-1: no hit).
    """
    origins, directions = pixel_rays(camera)
    length = np.linalg.norm(directions, axis=1)
    distance, face = caster.first_hits(origins, directions / length[:, None])
    hit = face >= 0
    shape = (camera.height_px, camera.width_px)
    depth = np.where(hit, distance, 0.0) / length
    normals = np.where(hit[:, None], caster.face_normals[face], 0.0)
    return depth.reshape(shape), normals.reshape(*shape, 3), face.reshape(shape)


def cast_pixels(caster: RayCaster, camera: Camera, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cast a ray through the centres of pixels ``(N, 2)`` int (row, column).

    Returns hit points in the object frame ``(N, 3)`` (meaningless without a hit), ray lengths (m), and face indices ``(N,)``
    (-1: no hit).
    """
    across = pixels[:, 1] + 0.5 - camera.width_px / 2
    down = pixels[:, 0] + 0.5 - camera.height_px / 2
    directions = np.stack([across / camera.focal_px, -down / camera.focal_px, -np.ones(len(pixels))], -1)
    directions = directions @ camera.camera_to_object[:3, :3].T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = np.broadcast_to(camera.position, directions.shape)
    length_m, faces = caster.first_hits(origins, directions)
    return origins + directions * np.where(faces >= 0, length_m, 0.0)[:, None], length_m, faces


def silhouette(caster: RayCaster, camera: Camera) -> np.ndarray:
    """Return the object's silhouette in an image, ``(H, W) bool``, at a resolution of four pixels, for placing labels."""
    _, _, face = cast_camera(caster, camera.resized(camera.width_px // 4, camera.height_px // 4))
    size = (camera.width_px, camera.height_px)
    return cv2.resize((face >= 0).astype(np.uint8), size, interpolation=cv2.INTER_NEAREST).astype(bool)


def visible_points(
    points: np.ndarray, normals: np.ndarray, camera: Camera, caster: RayCaster, tolerance_m: float
) -> np.ndarray:
    """Return which surface points ``(N, 3)`` with outward ``normals (N, 3)`` a camera sees, ``(N,) bool``.

    A point is visible if it is inside the image, faces the camera, and the first hit on the caster's mesh is within
    ``tolerance_m`` of the point. A point off the mesh is therefore not visible.
    """
    toward = points - camera.position
    distance = np.linalg.norm(toward, axis=1)
    toward = toward / distance[:, None]
    facing = -(normals * toward).sum(1) > FACING_COSINE
    seen = toward @ camera.camera_to_object[:3, :3]
    tangent = np.tan(camera.fov_y_rad / 2) * np.array([camera.width_px / camera.height_px, 1.0])
    inside = (np.abs(seen[:, :2]) < -seen[:, 2:] * tangent).all(1)
    hit, _ = caster.first_hits(np.broadcast_to(camera.position, points.shape), toward)
    return facing & inside & (np.abs(hit - distance) <= tolerance_m)


def visibility_tolerance_m(extents_m: np.ndarray) -> float:
    """Return the tolerance (m) for candidates on the visible surface, for an object with extents ``(3,)``."""
    return min(ON_SURFACE_M, ON_SURFACE_SHARE * float(extents_m.max()))


def merge_parts(parts: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Return the geometry of visual parts as one mesh."""
    vertices, faces = trimesh.util.append_faces([part.vertices for part in parts], [part.faces for part in parts])
    return trimesh.Trimesh(vertices, faces, process=False)
