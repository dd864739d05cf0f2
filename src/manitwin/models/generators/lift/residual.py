"""How well a solid explains a photo: its rendered outline against the matte, its creases against the photo's inner edges.

Every candidate for the shape of a photo, of whatever family, is measured by ``explained``, so that the choice between them is one
of numbers on one scale. Letters and patterns are edges of no shape: so creases must be seen in the photo, but edges of the photo
need no crease.
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
"""The longer side of the pictures that are compared: an outline is a pixel of 192 exact."""
CREASE_COSINE = 0.6  # faces that meet at more than 53 degrees are seen as an edge under any light
STEP_SHARE = 0.04  # of the object's depth: a jump in depth from one pixel to the next
NEAR_PX = 2.0
EDGE_WEIGHT = 0.15  # of the creases in the score: the outline is sure, what is seen inside depends on light and paint
TELESCOPE_FOV_RAD = np.deg2rad(1.0)
"""The angle of a camera so far away that its picture is a parallel projection."""


@dataclass(frozen=True)
class Explained:
    """``silhouette_iou``: overlap over union of the rendered outline and the matte; ``edge_support``: the share of the creases
    and steps inside the outline that lie on edges of the photo, None where there are none or no photo was given."""

    silhouette_iou: float
    edge_support: float | None = None

    @property
    def score(self) -> float:
        """The number that candidates are compared by, 1 for one that explains all; creases that nobody sees cost."""
        missing = 0.0 if self.edge_support is None else 1.0 - self.edge_support
        return self.silhouette_iou - EDGE_WEIGHT * missing

    @property
    def residual(self) -> float:
        """What the candidate leaves unexplained: 1 - ``score``."""
        return 1.0 - self.score


def explained(mesh: trimesh.Trimesh, camera: Camera, mask: np.ndarray, rgb: np.ndarray | None = None) -> Explained:
    """Render ``mesh`` from ``camera`` and compare it with a photo.

    ``mask (H, W) bool`` is the matte and ``rgb (H, W, 3) uint8`` the photo, of the camera's picture or any smaller size with its
    aspect; mesh and camera are in one frame and unit.
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
        return Explained(iou)
    facing = np.abs(normals @ small.camera_to_object[:3, 2])
    creases = _creases(depth, normals, facing, shown)
    return Explained(iou, _edge_support(creases, shown & wanted, cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)))


def parallel_camera(mask_shape: tuple[int, int], *, elevation_deg: float = 0.0) -> Camera:
    """Return the camera of a parallel projection onto a picture of ``mask_shape`` (H, W), for solids in its pixels.

    x runs to the right, y up, z towards the viewer; the camera looks down by ``elevation_deg`` e. The pixel (column, row) shows
    what has x = column and y cos(e) - z sin(e) = -row.
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
    """Return where neighbouring pixels of the solid see faces at an angle, or one far behind the other."""
    step = STEP_SHARE * float(np.ptp(depth[shown])) if shown.any() else 0.0
    found = np.zeros(shown.shape, bool)
    for here, there in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        both = shown[here] & shown[there]
        bent = (normals[here] * normals[there]).sum(axis=2) < CREASE_COSINE
        # a plane that runs away from the viewer is no step
        jump = np.abs(depth[here] - depth[there]) * np.maximum(0.2, np.minimum(facing[here], facing[there]))
        found[here] |= both & (bent | (jump > max(step, 1e-12)))
    return found
