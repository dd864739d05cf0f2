"""Propose grasps: near the selected points, touching well, free of collision, and different from each other.

Source: paper, "Grasp Proposal Generation", "Spatial Filtering and Semantic Association" and, in the appendix, "Grasp Generation
and Filtering" (4,000 candidates, 3 cm, 7-DoF farthest point sampling to 100).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from manitwin.config import GraspConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.geometry.grasp_diversity import approach_octants
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.models.graspers.protocol import Grasper, GraspProposals, GraspRequest
from manitwin.physics.grasp_selection import select_likely
from manitwin.pipeline.gripper_kinds import KINDS
from manitwin.pipeline.object_state import JOINTS, load_hulls, load_solid, read_given
from manitwin.pipeline.proposals import (
    Kept,
    associate,
    distances_to_grasps,
    on_support,
    propose_in_rounds,
    with_given,
    with_support_rounds,
)
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper

PROPOSALS = "proposals{}.npz"
PROPOSED = "proposals{}"
UNFILTERED = ":unfiltered"


class GraspsStage:
    """Propose, filter, associate and choose grasps.

    ``suffix`` is part of the artifacts' names: empty for the twin's first gripper. Where nothing fits, the first gripper
    rejects the object; another one is left with no proposals and the reason.
    """

    version = "3"
    reads: ClassVar[tuple[str, ...]] = ("solid.npz", "hulls.npz", "points", "physical", "placements", "geometry?")

    def __init__(self, settings: GraspConfig, grasper: Grasper, gripper: Gripper, suffix: str = ""):
        """Take the settings, the grasper and the gripper."""
        self.name = f"grasps{suffix}"
        self.file, self.proposed = PROPOSALS.format(suffix), PROPOSED.format(suffix)
        self.writes: tuple[str, ...] = (self.file, self.proposed)
        self.may_reject = not suffix
        self.settings, self.grasper, self.gripper = settings, grasper, gripper
        self.backend = grasper.name
        self.needs: Resource = grasper.needs
        self.model: str | None = f"{grasper.model or grasper.name} for {gripper.name} {gripper.sha256[:12]}"

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write ``proposals.npz``, return the field ``proposals``; raises Rejected where nothing fits the gripper."""
        settings, points = self.settings, draft.field("points")
        request = self._request(draft)
        screen = KINDS[self.gripper.kind].screen(request)
        kept = propose_in_rounds(request, self.grasper, screen, settings)
        kept = with_support_rounds(kept, request, self.grasper, screen, settings)
        kept, given = with_given(kept, read_given(draft), self.gripper, screen, request, settings.simulated)
        if not len(kept.proposals):
            answer = screen.why_none(kept.counts)
            if self.may_reject:
                raise answer
            self._write(folder / self.file, request, kept, np.empty(0, int), points, [])
            return {self.proposed: {"none_because": {"reason": answer.reason, "detail": answer.detail}}}
        nearest_m = kept.distance_m.min(1)
        association = associate(
            nearest_m[len(given) :],
            radius_m=settings.association_radius_m,
            enough=settings.simulated,
            object_size_m=float(np.linalg.norm(request.solid.extents)),
        )
        near = association.index + len(given)
        chosen = np.concatenate(
            [np.arange(len(given)), _likely(kept, near, self._on_support(kept, near, request), settings)]
        )
        self._write(folder / self.file, request, kept, chosen, points, given)
        octants = approach_octants(kept.proposals.gripper_to_object)
        return {
            self.proposed: {
                "proposed": len(kept.proposals),
                "proposed_by_filter": {
                    **kept.counts,
                    "after_association": len(near) + len(given),
                    "after_diversity": len(chosen),
                },
                "association_radius_m": association.radius_m,
                "association_radius_widened": association.widened,
                "share_beyond_3cm": float((nearest_m[chosen] > settings.association_radius_m).mean()),
                "approach_octants": len(np.unique(octants[chosen])),
                "octants_available": len(np.unique(octants)),
            }
        }

    def _on_support(self, kept: Kept, near: np.ndarray, request: GraspRequest) -> list[np.ndarray]:
        """Tell of each support which of the kept are near a point and leave room for it ``(N,)``."""
        gripper = self.gripper
        if not isinstance(gripper, ParallelGripper):
            return []
        is_near = np.zeros(len(kept.proposals), bool)
        is_near[near] = True
        radius_m = float("inf")  # what is near enough was decided by the association
        return [is_near & on_support(kept, gripper, support, radius_m) for support in request.supports]

    def _request(self, draft: Draft) -> GraspRequest:
        physical, points = draft.field("physical"), draft.field("points")
        return GraspRequest(
            solid=load_solid(draft.path("solid.npz")),
            hulls=load_hulls(draft.path("hulls.npz")),
            mass_kg=physical["mass_kg"]["value"],
            center_of_mass_m=np.array(physical["center_of_mass_m"]),
            object_friction=physical["friction_static"]["value"],
            gripper=self.gripper,
            focus_points_m=np.array([p["position_m"] for p in points["functional"] + points["grasp"]]),
            max_proposals=self.settings.raw_per_round,
            seed=draft.seed,
            grasp_points_m=np.array([p["position_m"] for p in points["grasp"]]),
            grasp_types=tuple(p["type"] for p in points["grasp"]),
            supports=picked_from(draft.field("placements")),
        )

    def _write(
        self,
        path: Path,
        request: GraspRequest,
        kept: Kept,
        chosen: np.ndarray,
        points: dict[str, Any],
        given: list[str],
    ) -> None:
        """Write the chosen grasps, then the unfiltered sample, with the ids of their nearest points.

        ``given`` are the proposers of the first of the chosen.
        """
        raw, count = kept.raw, min(self.settings.unfiltered, len(kept.raw))
        drawn = np.sort(np.random.default_rng(request.seed).choice(len(raw), count, replace=False))
        others = raw.take(drawn)
        both = GraspProposals.joined([kept.proposals.take(chosen), others])
        distance_m = np.concatenate([kept.distance_m[chosen], distances_to_grasps(request.focus_points_m, others)])
        functional = [point["id"] for point in points["functional"]]
        grasp = [point["id"] for point in points["grasp"]]
        name = self.grasper.name
        arrays = {
            "gripper_to_object": both.gripper_to_object,
            "width_m": both.width_m,
            "depth_m": both.depth_m,
            "score": both.score,
            "functional_point_id": np.array(functional)[distance_m[:, : len(functional)].argmin(1)],
            "grasp_point_id": np.array(grasp)[distance_m[:, len(functional) :].argmin(1)],
            "distance_to_point_m": distance_m.min(1),
            "proposer": np.array(
                [*given, *[name] * (len(chosen) - len(given)), *[name + UNFILTERED] * len(others)], str
            ),
            **_hand_joints(both),
        }
        np.savez(path, allow_pickle=False, **arrays)


def picked_from(placements: list[dict[str, Any]]) -> tuple[np.ndarray, ...]:
    """Return ``object_to_plane (4, 4)`` of the placements that robots will find the object in.

    These are the most probable of those that stayed, and the most probable upright one of them.
    """
    settled = sorted((p for p in placements if p["settled"]), key=lambda p: -p["probability"])
    upright = [p for p in settled if p["upright"]]
    first = [*settled[:1], *(p for p in upright[:1] if p is not settled[0])]
    return tuple(
        transform(rotation_from_quaternion_wxyz(np.array(p["quaternion_wxyz"])), np.array(p["position_m"]))
        for p in first
    )


def _likely(kept: Kept, near: np.ndarray, on_support: list[np.ndarray], settings: GraspConfig) -> np.ndarray:
    """Choose among the kept at ``near``; of those in each of ``on_support`` (``(N,)`` bool) no less than their share."""
    chosen = _select(kept, near, settings.simulated)
    wanted = round(settings.on_support_share * settings.simulated)
    short = [np.flatnonzero(free) for free in on_support if free[chosen].sum() < min(wanted, int(free.sum()))]
    if not short:
        return chosen
    sure = np.unique(np.concatenate([_select(kept, free, wanted) for free in short]))
    rest = np.setdiff1d(near, sure)
    return np.sort(np.concatenate([sure, _select(kept, rest, settings.simulated - len(sure))]))


def _select(kept: Kept, among: np.ndarray, count: int) -> np.ndarray:
    if not len(among) or count <= 0:
        return among[:0]
    some = kept.proposals.take(among)
    return among[select_likely(some.gripper_to_object, some.depth_m, kept.merits.take(among), count)]


def _hand_joints(proposals: GraspProposals) -> dict[str, np.ndarray]:
    """Return the joints as the arrays that a table keeps, none for a gripper without."""
    if proposals.joints_rad is None:
        return {}
    return dict(zip(JOINTS, proposals.joints_rad.transpose(1, 0, 2), strict=True))
