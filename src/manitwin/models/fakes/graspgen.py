"""GraspGen's server, as far as its client can tell: actions, fields, defaults, errors and both ways of finding nothing.

Keeps the contract of ``grasp_gen/serving/zmq_server.py`` of github.com/NVlabs/GraspGen as read in 2026-11. As there,
unknown fields are ignored, a threshold of -1 without a topk means the best hundred, and a model that yields nothing makes
an error of PyTorch. No model: grasps are facing pairs of points of the cloud.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.models.fakes.cloud_grasps import FRANKA_PANDA, cloud_grasps
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.message_server import MessageServer

TOPK_WITHOUT_THRESHOLD = 100


class FakeGraspGen(MessageServer):
    """Serve grasps of the hand ``gripper_name``; faults are those of every message server, ``no_grasps``, ``wrong_schema``.

    ``no_grasps`` takes turns: empty arrays, then the error. There is no key: ``key`` is there as in every fake, unused.
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
        """Answer as the original does."""
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
        """Return the message of what was raised."""
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
