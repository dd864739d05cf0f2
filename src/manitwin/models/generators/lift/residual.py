"""Fit of a solid to a photo: rendered silhouette against mask, and creases against inner edges of the photo.

``explained`` measures every candidate shape of any family on the same scale, so that candidates can be compared by numbers.
Letters and patterns are edges without a shape, so creases must be visible in the photo, but edges of the photo need no
crease.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import Camera
from manitwin.render.raycast import cast_camera

SIDE_PX = 192
"""Longer side of the compared pictures; silhouettes are accurate to a pixel of 192."""
CREASE_COSINE = 0.6  # faces that meet at more than 53 degrees are visible as an edge under any light
STEP_SHARE = 0.04  # of the object's depth: minimum depth discontinuity between adjacent pixels
NEAR_PX = 2.0
EDGE_WEIGHT = 0.15  # weight of creases in the score: the silhouette is reliable, inner edges depend on light and paint
TELESCOPE_FOV_RAD = np.deg2rad(1.0)
"""Field of view of a camera so far away that its projection is practically parallel."""


@dataclass(frozen=True)
class FitQuality:
    """How well a solid explains a photo.

    ``silhouette_iou`` is the intersection over union of the rendered silhouette and the mask. ``edge_support`` is the share
    of creases and depth steps inside the silhouette that lie on edges of the photo; None if there are none or no photo was
    given.
    """

    silhouette_iou: float
    edge_support: float | None = None

    @property
    def score(self) -> float:
        """Score for comparing candidates, 1 for a perfect one; creases that are not visible in the photo lower it."""
        missing = 0.0 if self.edge_support is None else 1.0 - self.edge_support
        return self.silhouette_iou - EDGE_WEIGHT * missing

    @property
    def unexplained_share(self) -> float:
        """Unexplained part: 1 - ``score``."""
        return 1.0 - self.score


def compute_fit_quality(
    mesh: trimesh.Trimesh, camera: Camera, mask: np.ndarray, rgb: np.ndarray | None = None
) -> FitQuality:
    """Render ``mesh`` from ``camera`` and compare it with a photo.

    ``mask (H, W) bool`` is the matte and ``rgb (H, W, 3) uint8`` the photo, of the size of the camera's picture or smaller
    with the same aspect ratio; mesh and camera are in the same frame and unit.
    """
    scale = SIDE_PX / max(camera.width_px, camera.height_px)
    small = camera.resized(max(1, round(camera.width_px * scale)), max(1, round(camera.height_px * scale)))
    size = (small.width_px, small.height_px)
    wanted = cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0.5
    depth, normals, face = cast_camera(RayCaster(mesh), small)
    shown = face >= 0
    union = (shown | wanted).sum()
    iou = float((shown & wanted).sum() / union) if union else 0.0
    if rgb is None:
        return FitQuality(iou)
    facing = np.abs(normals @ small.camera_to_object[:3, 2])
    creases = _creases(depth, normals, facing, shown)
    return FitQuality(iou, _edge_support(creases, shown & wanted, cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)))


def parallel_camera(mask_shape: tuple[int, int], *, elevation_deg: float = 0.0) -> Camera:
    """Return a (nearly) parallel projection onto a picture of ``mask_shape`` (H, W), for solids in its pixels.

    x is to the right, y up, z towards the viewer; the camera looks down by ``elevation_deg`` e. The pixel (column, row) shows
    points with x = column and y cos(e) - z sin(e) = -row.
    """
    height, width = mask_shape
    distance = height / 2 / float(np.tan(TELESCOPE_FOV_RAD / 2))
    angle = np.deg2rad(elevation_deg)
    pose = np.eye(4)
    pose[:3, :3] = [[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]]
    middle = np.array([(width - 1) / 2, (1 - height) / 2])
    pose[:3, 3] = pose[:3, :2] @ middle + distance * pose[:3, 2]
    return Camera(pose, TELESCOPE_FOV_RAD, width, height)


def _edge_support(creases: np.ndarray, object_px: np.ndarray, rgb: np.ndarray) -> float | None:
    """Return the share of creases within NEAR_PX of strong edges of the photo; None if there are hardly any creases."""
    inside = cv2.erode(object_px.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    creases = creases & inside
    if creases.sum() < 0.02 * SIDE_PX:
        return None
    lab = cv2.cvtColor(cv2.GaussianBlur(rgb, (0, 0), 0.8).astype(np.float32) / 255, cv2.COLOR_RGB2Lab)
    across = [cv2.Scharr(lab, cv2.CV_32F, dx, 1 - dx) / 32 for dx in (0, 1)]
    strength = np.sqrt(sum((gradient**2).sum(axis=2) for gradient in across))
    strong = strength > max(1.0, 2.0 * float(np.median(strength[inside])))
    if not strong.any():
        return 0.0
    away = cv2.distanceTransform((~strong).astype(np.uint8), cv2.DIST_L2, 5)
    return float((away[creases] <= NEAR_PX).mean())


def _creases(depth: np.ndarray, normals: np.ndarray, facing: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Return the pixels where adjacent pixels of the solid show faces at an angle, or a depth discontinuity."""
    step = STEP_SHARE * float(np.ptp(depth[shown])) if shown.any() else 0.0
    found = np.zeros(shown.shape, bool)
    for here, there in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        both = shown[here] & shown[there]
        bent = (normals[here] * normals[there]).sum(axis=2) < CREASE_COSINE
        # an oblique plane is not a step
        jump = np.abs(depth[here] - depth[there]) * np.maximum(0.2, np.minimum(facing[here], facing[there]))
        found[here] |= both & (bent | (jump > max(step, 1e-12)))
    return found
