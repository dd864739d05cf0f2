"""GraspGenX, one grasp model for any gripper, behind its own server.

The protocol is that of the public repository github.com/NVlabs/GraspGenX (``client-server/README.md``, "Protocol Reference",
and ``graspgenx/serving/{zmq_server,types}.py``, Apache-2.0, read 2026-11; weights under the NVIDIA Open Model License):
msgpack over ZeroMQ REQ/REP. The action ``infer_object`` describes the gripper by two boxes, between its open and its
half-open fingers, in its base frame (+Z approach, +X closing). They are computed from our gripper file in the grasp frame, so
the answer is in the grasp frame too and the server needs no files of the gripper.

The client was tested against a mock server of this package, not against the model itself. Unverified: the quality for
grippers that the model was not trained with. The server takes no seed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.config import BuildConfig, Resource
from manitwin.errors import BadReply, Unavailable
from manitwin.models.graspers.grasp_server import GraspServer, said, server_url
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.models.graspers.served_proposals import ASKED_FOR, ask_for_proposals, point_cloud
from manitwin.robots.grippers.gripper import require_kind
from manitwin.robots.grippers.parallel import ParallelGripper

POINTS = 3500  # points that its demo samples of a mesh (scripts/demo_object_mesh.py)
ACTION = "infer_object"
PARALLEL_2F = 0  # the server's code of the gripper type


def sweep_volume(gripper: ParallelGripper) -> dict[str, Any]:
    """Return the boxes between the pads, open and half open: extents and centres ``(3,) float32`` in m, in the grasp frame.

    The published description of the Panda also uses the space between the pads (sweep_volume of
    gripper_descriptions/assets/x_grippers/franka_panda/config.json, github.com/beininghan/gripper_descriptions).
    """
    across_m, along_m = (2 * half for half in gripper.pad_half_extents_m)
    center = np.array([0, 0, gripper.tip_depth_m], np.float32)
    return {
        "extents_open": np.array([gripper.opening_m, across_m, along_m], np.float32),
        "offset_open": center,
        "extents_mid": np.array([gripper.opening_m / 2, across_m, along_m], np.float32),
        "offset_mid": center,
        "gripper_type": PARALLEL_2F,
        "fingertip_depth": gripper.tip_depth_m,
    }


class GraspGenXGrasper:
    """Propose grasps with a GraspGenX server, for any parallel gripper."""

    name = "graspgenx"
    needs: Resource = "gpu"
    # one answer is the paper's whole sample; further requests add similar grasps
    rounds: int | None = 1
    model: str | None = f"GraspGenX by swept volume, diffusion, {POINTS} points, {ASKED_FOR} grasps"

    def __init__(self, server: GraspServer):
        self._server = server

    @classmethod
    def from_spec(cls, argument: str, config: BuildConfig) -> GraspGenXGrasper:
        """Create it from the server's address."""
        return cls(GraspServer(server_url(argument, cls.name), cls.name, config.services))

    def propose(self, request: GraspRequest) -> GraspProposals:
        """Return up to ``max_proposals`` grasps, best first; an empty result if the model finds none.

        Raises Unavailable if the server does not answer, BadReply if its answer is unusable.
        """
        gripper = require_kind(request.gripper, ParallelGripper)
        question = {
            "action": ACTION,
            "point_cloud": point_cloud(request, POINTS),
            "sweep_volume_params": sweep_volume(gripper),
            "num_grasps": min(ASKED_FOR, request.max_proposals),
            # the other planner adds grasps of the bounding box, which do not come from the model
            "planner": "diffusion",
        }
        return ask_for_proposals(self._server, question, request, gripper)

    def probe(self) -> str:
        """Query the server's state; raises Unavailable if it is too old to take a gripper description."""
        self._server.ask({"action": "health"})
        served = self._server.ask({"action": "metadata"})
        actions = served.get("actions")
        if not isinstance(actions, list) or not any(isinstance(name, str) and name == ACTION for name in actions):
            raise Unavailable(f"{self.name}: the server at {self._server.url} has no action {ACTION}; update it")
        if not isinstance(served.get("model"), dict):
            raise BadReply(
                f"{self.name}: the server at {self._server.url} does not say which model it serves; update it"
            )
        return f"serves any parallel gripper ({said(served['model'].get('generator_backbone'))})"
