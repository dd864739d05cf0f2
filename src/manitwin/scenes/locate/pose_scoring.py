"""Scoring of poses: depth of the object rendered at a pose compared with the observed depth."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from manitwin.geometry.poses import inverse
from manitwin.scenes.locate.depth_view import DepthView, known_depth
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.registration import point_to_plane_step

NEAR_PX = 12
"""Pixels around the mask that contain most of what a wrong pose shows in excess; they are sampled more densely."""


@dataclass(frozen=True)
class PixelSamples:
    """Sampled pixels of a picture: the first ``inside`` show the object, the others lie around it.

    ``rays (N, 3)`` have unit length, ``stretch (N,)`` is distance over depth, and ``weight (N,)`` the number of pixels that
    each sample represents.
    """

    rays: np.ndarray
    stretch: np.ndarray
    depth_m: np.ndarray
    weight: np.ndarray
    inside: int
    pixels: np.ndarray

    @classmethod
    def sample(
        cls, view: DepthView, mask: np.ndarray, reach_px: float, count: int, rng: np.random.Generator
    ) -> PixelSamples:
        """Sample ``count`` pixels of the ``mask (H, W) bool`` and as many around it, up to ``reach_px`` from its bounding box."""
        rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
        far = np.zeros_like(mask)
        pad = int(np.ceil(reach_px))
        far[max(rows[0] - pad, 0) : rows[-1] + pad + 1, max(columns[0] - pad, 0) : columns[-1] + pad + 1] = True
        near = cv2.dilate(mask.astype(np.uint8), np.ones((2 * NEAR_PX + 1,) * 2, np.uint8)).astype(bool)
        told = view.depth_m > 0
        zones = (mask & known_depth(view), near & ~mask & told, far & ~near & told)
        picked: list[np.ndarray] = []
        weights: list[np.ndarray] = []
        for zone, wanted in zip(zones, (count, count // 2, count // 2), strict=True):
            there = np.flatnonzero(zone)
            chosen = rng.choice(there, min(wanted, len(there)), replace=False)
            picked.append(chosen)
            weights.append(np.full(len(chosen), len(there) / max(len(chosen), 1)))
        pixels = np.concatenate(picked)
        rays = view.rays(pixels)
        stretch = np.linalg.norm(rays, axis=1)
        return cls(
            rays / stretch[:, None],
            stretch,
            view.depth_m.ravel()[pixels],
            np.concatenate(weights),
            len(picked[0]),
            pixels,
        )


def rendered_depth_m(model: PoseModel, poses: np.ndarray, evidence: PixelSamples) -> tuple[np.ndarray, np.ndarray]:
    """Return the depth (m; inf: nothing) and the face index ``(K, N)`` of the rendered object at each sample in each pose."""
    back = inverse(poses)
    directions = np.einsum("kij,nj->kni", back[:, :3, :3], evidence.rays)
    origins = np.broadcast_to(back[:, None, :3, 3], directions.shape)
    distance, face = model.caster.first_hits(origins.reshape(-1, 3), directions.reshape(-1, 3))
    shape = directions.shape[:2]
    return distance.reshape(shape) / evidence.stretch, face.reshape(shape)


def score_poses(model: PoseModel, poses: np.ndarray, evidence: PixelSamples, tolerance_m: float) -> np.ndarray:
    """Return the score ``(K,)`` in 0..1 of poses: explained pixels over the union of observed and wrongly shown ones.

    It is 1 minus the Visible Surface Discrepancy (Hodan et al. 2016, equation 1) with a cost that grows quadratically with the
    difference up to ``tolerance_m``. Pixels in which the pose is in front of the surroundings count as wrongly shown, those
    behind them as hidden.
    """
    return scores_of(pixel_gains(model, poses, evidence, tolerance_m), evidence)


def pixel_gains(model: PoseModel, poses: np.ndarray, evidence: PixelSamples, tolerance_m: float) -> np.ndarray:
    """Return the gain of each sampled pixel for each pose, ``(K, N)``: 0..1 is explained inside, -1 is wrongly shown outside."""
    drawn, _ = rendered_depth_m(model, poses, evidence)
    n = evidence.inside
    off = np.minimum(np.abs(drawn[:, :n] - evidence.depth_m[:n]) / tolerance_m, 1.0)
    wrong = drawn[:, n:] < evidence.depth_m[n:] - tolerance_m
    return np.concatenate([1 - off**2, -wrong.astype(float)], axis=1)


def scores_of(gains: np.ndarray, evidence: PixelSamples) -> np.ndarray:
    """Return the scores ``(K,)`` for gains."""
    n = evidence.inside
    weighted = gains * evidence.weight
    return np.asarray(weighted[:, :n].sum(1) / (evidence.weight[:n].sum() - weighted[:, n:].sum(1)))


def refine_poses(
    model: PoseModel, poses: np.ndarray, evidence: PixelSamples, tolerance_m: float, iterations: int
) -> np.ndarray:
    """Return ``object_to_camera (K, 4, 4)`` after point-to-plane steps on the samples of the object.

    Pairs are the observed and the rendered point on the same ray (Blais and Levine 1995), which never pairs the outside of a
    thin wall with its inside. Pairs more than three tolerances apart are ignored; the others are weighted by Tukey's biweight.
    """
    n = evidence.inside
    rays = evidence.rays[:n] * evidence.stretch[:n, None]
    seen = rays * evidence.depth_m[:n, None]
    reach_m = 3 * tolerance_m
    for _ in range(iterations):
        back = inverse(poses)
        drawn, face = rendered_depth_m(model, poses, evidence)
        drawn, face = drawn[:, :n], face[:, :n]
        apart = np.where(face >= 0, np.abs(drawn - evidence.depth_m[:n]), np.inf)
        weight = np.clip(1 - (apart / reach_m) ** 2, 0, None) ** 2
        points = np.einsum("kij,nj->kni", back[:, :3, :3], seen) + back[:, None, :3, 3]
        shown = np.where(face >= 0, drawn, 0.0)[..., None] * rays
        shown = np.einsum("kij,knj->kni", back[:, :3, :3], shown) + back[:, None, :3, 3]
        normals = model.caster.face_normals[face]
        poses = point_to_plane_step(poses, points, shown, normals, weight, model.diameter_m)
    return poses
