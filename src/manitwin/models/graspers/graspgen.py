"""GraspGen, the paper's grasp model, behind its own server.

The protocol is that of the public repository github.com/NVlabs/GraspGen (``grasp_gen/serving/zmq_server.py`` and
``client-server/README.md``, 2026): msgpack over ZeroMQ REQ/REP, ``{"action": "health" | "metadata" | "infer", ...}``. The
model's code and weights are NVIDIA's, for non-commercial research only, and are not included here. The client was written
from the source and tested against a mock server of this package, not against the model itself.

The server takes no seed, so repeated requests return different grasps. The proposals are stored with the stage.
"""

from __future__ import annotations

from typing import Any

from manitwin.config import BuildConfig, Resource
from manitwin.errors import ConfigError, Unavailable
from manitwin.models.graspers.grasp_server import GraspServer, said, server_url
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.models.graspers.served_proposals import ASKED_FOR, BASE_LINK_Z_M, HANDS, ask_for_proposals, point_cloud
from manitwin.robots.grippers.gripper import Gripper, load_gripper, require_kind
from manitwin.robots.grippers.parallel import ParallelGripper

POINTS = 2000  # points that its client samples of a mesh (client-server/graspgen_client.py), as in training
NO_THRESHOLD = -1.0


class GraspGenGrasper:
    """Propose grasps with a GraspGen server, for the hand that it serves."""

    name = "graspgen"
    needs: Resource = "gpu"
    # one answer is the paper's whole sample; further requests add similar grasps
    rounds: int | None = 1

    def __init__(self, server: GraspServer, hand: str):
        """Take the server and the name of the GraspGen hand that it must serve."""
        self._server, self._hand = server, hand
        self.model: str | None = f"GraspGen {hand}, {POINTS} points, {ASKED_FOR} grasps"

    @classmethod
    def from_spec(cls, argument: str, config: BuildConfig) -> GraspGenGrasper:
        """Create it from the server's address; raises ConfigError if GraspGen has no model for a configured parallel gripper."""
        parallel = [g for g in map(load_gripper, config.grippers) if g.kind == ParallelGripper.kind]
        hands = [_hand_of(gripper) for gripper in parallel] or list(HANDS.values())
        return cls(GraspServer(server_url(argument, cls.name), cls.name, config.services), hands[0])

    def propose(self, request: GraspRequest) -> GraspProposals:
        """Return up to ``max_proposals`` grasps, best first; an empty result if the model finds none.

        Raises Unavailable if the server does not answer or serves another hand, BadReply if its answer is unusable,
        ConfigError for a gripper without a model.
        """
        gripper = require_kind(request.gripper, ParallelGripper)
        hand = _hand_of(gripper)
        self._require(hand)
        count = min(ASKED_FOR, request.max_proposals)
        question = {
            "action": "infer",
            "point_cloud": point_cloud(request, POINTS),
            # a threshold of -1 without topk would return only the best hundred
            "grasp_threshold": NO_THRESHOLD,
            "num_grasps": count,
            "topk_num_grasps": count,
            "min_grasps": 1,
            "max_tries": 6,
            # the points of a large mesh lie farther apart than the server's limit for outliers
            "remove_outliers": False,
        }
        return ask_for_proposals(self._server, question, request, gripper, BASE_LINK_Z_M[hand])

    def probe(self) -> str:
        """Query the server's state; raises Unavailable if it serves another hand."""
        self._server.ask({"action": "health"})
        return f"serves {self._hand} ({said(self._require(self._hand).get('model_name'))})"

    def _require(self, hand: str) -> dict[str, Any]:
        served = self._server.ask({"action": "metadata"})
        name = served.get("gripper_name")
        if not isinstance(name, str) or name != hand:
            raise Unavailable(
                f"{self.name}: the server at {self._server.url} serves {said(name)}, not {hand};"
                f" start it with --gripper_config graspgen_{hand}.yml"
            )
        return served


def _hand_of(gripper: Gripper) -> str:
    if gripper.name not in HANDS:
        known = ", ".join(f"{name} ({hand})" for name, hand in HANDS.items())
        raise ConfigError(
            f"graspgen has no model for gripper {gripper.name}, only for {known}; choose graspgenx, which takes any"
            " parallel gripper, or antipodal"
        )
    return HANDS[gripper.name]
