"""Fake servers of GraspGen and GraspGenX with the original actions, fields, defaults and errors.

The contracts are those of ``grasp_gen/serving/zmq_server.py`` of github.com/NVlabs/GraspGen and of
``graspgenx/serving/{zmq_server,types}.py`` of github.com/NVlabs/GraspGenX as read in 2026-11. There is no learned model: grasps
are antipodal point pairs of the cloud.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.message_server import MessageServer

TOPK_WITHOUT_THRESHOLD = 100
ACTIONS = ("health", "metadata", "infer_object")
BOXES = ("extents_open", "offset_open", "extents_mid", "offset_mid")
PLANNERS = ("diffusion", "graspmoe")
NEIGHBOURS = 12  # number of points for the tangent plane of a point
LEAST_FACING = 0.94  # cosine of 20 degrees
BESIDE_M = 0.005  # maximum distance of the partner from the line along a point's normal
THINNEST_M = 0.001
BLOCK = 256


class FakeGraspGen(MessageServer):
    """Serve grasps of the hand ``gripper_name``. Faults: those of every message server, ``no_grasps`` and ``wrong_schema``.

    As in the original, unknown fields are ignored, a threshold of -1 without topk means the best hundred, and a model without
    results causes a PyTorch error. ``no_grasps`` alternates between empty arrays and that error. ``key`` is unused; it exists for
    uniformity with the other fakes.
    """

    def __init__(
        self,
        faults: Faults | None = None,
        key: str = "",
        port: int = 0,
        gripper_name: str = "franka_panda",
    ):
        self._faults = faults or Faults()
        self._gripper_name, self._empty_answers = gripper_name, 0
        super().__init__(self, self._faults, port)

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """Answer a request like the original."""
        action = request.get("action")
        if action == "health":
            return {"status": "ok"}
        if action == "metadata":
            return {
                "gripper_name": self._gripper_name,
                "model_name": "diffusion-discriminator",
                "gripper_config": f"/models/checkpoints/graspgen_{self._gripper_name}.yml",
            }
        if action == "infer":
            return self._infer(request)
        return {"error": f"Unknown action: {action}"}

    def error(self, error: Exception) -> dict[str, Any]:
        """Return the error message of an exception."""
        return {"error": str(error)}

    def _infer(self, request: dict[str, Any]) -> dict[str, Any]:
        cloud = request.get("point_cloud")
        if cloud is None:
            return {"error": "Missing required field 'point_cloud'"}
        cloud = np.asarray(cloud, dtype=np.float32)
        if cloud.ndim != 2 or cloud.shape[1] != 3:
            return {"error": f"point_cloud must be (N, 3), got {cloud.shape}"}
        threshold, topk = float(request.get("grasp_threshold", -1.0)), int(request.get("topk_num_grasps", -1))
        if threshold == -1.0 and topk == -1:
            topk = TOPK_WITHOUT_THRESHOLD
        if self._faults.strike("no_grasps"):
            self._empty_answers += 1
            if self._empty_answers % 2 == 0:
                raise TypeError("expected Tensor as element 0 in argument 0, but got list")
            cloud = cloud[:0]
        poses, scores = cloud_grasps(cloud, int(request.get("num_grasps", 200)), FRANKA_PANDA)
        poses, scores = poses[scores >= threshold], scores[scores >= threshold]
        if topk != -1:
            poses, scores = poses[:topk], scores[:topk]
        answer = {"grasps": poses, "confidences": scores, "num_grasps": len(poses), "timing": {"infer_ms": 1.0}}
        if self._faults.strike("wrong_schema"):
            del answer["confidences"]
        return answer


class FakeGraspGenX(MessageServer):
    """Serve grasps of any parallel gripper. Faults: those of every message server, ``no_grasps`` and ``wrong_schema``.

    Grasps fit a jaw of the requested size. The action ``infer`` by gripper name and the scene actions are not implemented.
    ``key`` is unused; it exists for uniformity with the other fakes.
    """

    def __init__(self, faults: Faults | None = None, key: str = "", port: int = 0):
        self._faults = faults or Faults()
        super().__init__(self, self._faults, port)

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """Answer a request like the original."""
        action = request.get("action")
        if action == "health":
            return {"status": "ok"}
        if action == "metadata":
            return {
                "default_gripper": None,
                "loaded_grippers": [],
                "model": {
                    "generator_backbone": "ptv3vanilla",
                    "discriminator_backbone": "ptv3vanilla",
                    "grasp_repr": "r3_so3",
                    "num_diffusion_iters_eval": 20,
                },
                "assets_dir": "/code/assets",
                "actions": list(ACTIONS),
                "precision": {"weights": "fp32", "tensorrt": False, "tensorrt_precision": None},
            }
        if action == "infer_object":
            return self._infer_object(request)
        raise ValueError(f"Unknown action: {action!r}")

    def error(self, error: Exception) -> dict[str, Any]:
        """Return the type and message of an exception."""
        return {"error": f"{type(error).__name__}: {error}"}

    def _infer_object(self, request: dict[str, Any]) -> dict[str, Any]:
        jaw = _jaw(request)
        cloud = request.get("point_cloud")
        if cloud is None:
            raise ValueError("Request is missing 'point_cloud'.")
        cloud = np.asarray(cloud, dtype=np.float32)
        if cloud.ndim != 2 or cloud.shape[1] != 3 or not len(cloud):
            raise ValueError(f"point_cloud must be non-empty (N, 3); got {cloud.shape}")
        planner = str(request.get("planner", "graspmoe"))
        if planner not in PLANNERS:
            raise ValueError(f"Unknown planner {planner!r}; expected 'diffusion' or 'graspmoe'.")
        rejected = {"grasp_threshold", "topk_num_grasps"} & set(request)
        if rejected:
            raise ValueError(f"{sorted(rejected)} are not accepted by action 'infer_object'")
        if self._faults.strike("no_grasps"):
            cloud = cloud[:0]
        poses, scores = cloud_grasps(cloud, int(request.get("num_grasps", 200)), jaw)
        answer = {
            "grasps": poses,
            "confidences": scores,
            "branch_tags": ["diff"] * len(poses),
            "timing": {"infer_ms": 1.0},
        }
        if self._faults.strike("wrong_schema"):
            del answer["confidences"]
        return answer


def _jaw(request: dict[str, Any]) -> Jaw:
    """Return the jaw described by the two sweep volume boxes; raises ValueError if they are invalid."""
    if "gripper_name" in request:
        raise ValueError("Action 'infer_object' takes sweep-volume params only — 'gripper_name' is not accepted.")
    given = request.get("sweep_volume_params")
    if given is None:
        raise ValueError("Request is missing 'sweep_volume_params'.")
    if not isinstance(given, dict):
        given = dict(zip(BOXES, np.asarray(given, np.float32).reshape(4, 3), strict=True))
    unknown = set(given) - {*BOXES, "gripper_type", "fingertip_depth"}
    if unknown:
        raise ValueError(f"Unknown sweep_volume_params keys: {sorted(unknown)}.")
    missing = set(BOXES) - set(given)
    if missing:
        raise ValueError(f"sweep_volume_params missing keys: {sorted(missing)}")
    boxes = {name: np.asarray(given[name], np.float32).reshape(-1) for name in BOXES}
    for name, values in boxes.items():
        if values.shape != (3,) or not np.isfinite(values).all():
            raise ValueError(f"SweepVolumeParams.{name} must have 3 finite elements; got {values.tolist()}")
        if name.startswith("extents") and not (values > 0).all():
            raise ValueError(f"SweepVolumeParams.{name} must be strictly positive; got {values.tolist()}")
    if int(given.get("gripper_type", 0)) not in (0, 1, 2):
        raise ValueError(f"gripper_type must be 0, 1 or 2; got {given['gripper_type']}")
    width, across, along = (float(value) for value in boxes["extents_open"])
    return Jaw(width, float(boxes["offset_open"][2]), (across / 2, along / 2))


@dataclass(frozen=True)
class Jaw:
    """A parallel jaw: maximum opening, depth of the fingertip centre, and half the width and height of the pads, in metres."""

    opening_m: float
    tip_depth_m: float
    pad_m: tuple[float, float]


FRANKA_PANDA = Jaw(0.080, 0.1034, (0.00875, 0.00925))


def cloud_grasps(cloud: np.ndarray, count: int, jaw: Jaw) -> tuple[np.ndarray, np.ndarray]:
    """Return at most ``count`` poses ``(M, 4, 4) float32`` and scores ``(M,) float32`` in [0, 1], best first.

    Equal clouds give equal grasps.
    """
    points = np.asarray(cloud, float)
    if len(points) < NEIGHBOURS:
        return np.empty((0, 4, 4), np.float32), np.empty(0, np.float32)
    rng = np.random.default_rng(zlib.crc32(np.ascontiguousarray(cloud).tobytes()))
    normals = _normals(points)
    first, width_m, facing = _pairs(points, normals, jaw)
    if not len(first):
        return np.empty((0, 4, 4), np.float32), np.empty(0, np.float32)
    drawn = rng.integers(len(first), size=2 * count)
    first, width_m, facing = first[drawn], width_m[drawn], facing[drawn]
    poses = _poses(points[first], normals[first], width_m, jaw, rng)
    blocked = np.concatenate([_blocked(points, poses[i : i + BLOCK], jaw) for i in range(0, len(poses), BLOCK)])
    score = np.where(blocked, 0.4, 1.0) * (0.5 + 0.5 * (facing - LEAST_FACING) / (1 - LEAST_FACING))
    best = np.argsort(-score, kind="stable")[:count]
    return poses[best].astype(np.float32), score[best].astype(np.float32)


def _normals(points: np.ndarray) -> np.ndarray:
    """Return unit normals ``(N, 3)`` of arbitrary sign: the smallest principal axis of each point's neighbours."""
    around = points[cKDTree(points).query(points, NEIGHBOURS)[1]]
    centered = around - around.mean(1, keepdims=True)
    return np.linalg.svd(centered, full_matrices=False)[2][:, 2]


def _pairs(points: np.ndarray, normals: np.ndarray, jaw: Jaw) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return first-point indices, signed distances to the partner along the normal, and absolute cosines of both normals."""
    centered = points - points.mean(0)  # improves the precision of the squared distances below
    square, found = (centered**2).sum(1), []
    for start in range(0, len(points), BLOCK):
        some, normal = centered[start : start + BLOCK], normals[start : start + BLOCK]
        along = normal @ centered.T - (normal * some).sum(1)[:, None]
        beside = square[start : start + BLOCK, None] + square - 2 * some @ centered.T - along**2
        facing = np.abs(normal @ normals.T)
        fits = (np.abs(along) > THINNEST_M) & (np.abs(along) < jaw.opening_m - 0.002)
        i, j = np.nonzero(fits & (beside < BESIDE_M**2) & (facing > LEAST_FACING))
        found.append((i + start, along[i, j], facing[i, j]))
    first, width_m, facing = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return first, width_m, facing


def _poses(
    first_m: np.ndarray, normals: np.ndarray, width_m: np.ndarray, jaw: Jaw, rng: np.random.Generator
) -> np.ndarray:
    """Return gripper poses with X along the normal, the fingertips centred between both points, and random approach
    directions.
    """
    count = len(first_m)
    x = normals * np.sign(width_m)[:, None]
    z = rng.normal(size=(count, 3))
    z -= (z * x).sum(1, keepdims=True) * x
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, 0], poses[:, :3, 1], poses[:, :3, 2] = x, np.cross(z, x), z
    depth_m = jaw.tip_depth_m + rng.uniform(-0.005, 0.005, count)
    poses[:, :3, 3] = first_m + normals * width_m[:, None] / 2 - depth_m[:, None] * z
    return poses


def _blocked(points: np.ndarray, poses: np.ndarray, jaw: Jaw) -> np.ndarray:
    """Return for each pose whether points lie inside the open fingers or the palm."""
    rotation, origin = poses[:, :3, :3], poses[:, :3, 3]
    x, y, z = np.moveaxis(np.einsum("nki,npk->inp", rotation, points[None] - origin[:, None]), 0, 0)
    half_y, half_z = jaw.pad_m
    top = jaw.tip_depth_m + half_z
    beside = np.abs(np.abs(x) - jaw.opening_m / 2 - 0.012) < 0.014
    finger = beside & (np.abs(y) < half_y + 0.003) & (z > 0) & (z < top)
    palm = (z < jaw.tip_depth_m - 0.035) & (z > -0.05) & (np.abs(x) < 0.11) & (np.abs(y) < 0.034)
    return (finger | palm).any(1)
