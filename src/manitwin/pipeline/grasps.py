"""Grasp proposal: near the selected points, with good pad contact, collision-free, and diverse.

Source: paper, "Grasp Proposal Generation", "Spatial Filtering and Semantic Association" and, in the appendix, "Grasp Generation
and Filtering" (4,000 candidates, 3 cm, 7-DoF farthest point sampling to 100).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.config import GraspConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.geometry.grasp_diversity import approach_octants
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.models.graspers.protocol import Grasper, GraspProposals, GraspRequest
from manitwin.physics.grasp_selection import select_likely
from manitwin.pipeline.gripper_kinds import KINDS
from manitwin.pipeline.link_grasps import ChosenLink
from manitwin.pipeline.object_state import JOINTS, load_hulls, load_solid, read_given
from manitwin.pipeline.point_search import HOPELESS_TRIES
from manitwin.pipeline.proposals import (
    ScreenedProposals,
    associate,
    on_support,
    propose_in_rounds,
    with_given,
    with_support_rounds,
)
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper

PROPOSALS = "proposals{}.npz"
PROPOSED = "proposals{}"
GRASP_POINTS = "grasp_points"
"""The grasp points after the first gripper's trials: ``{grasp, withdrawn}``."""
UNFILTERED = ":unfiltered"
QUOTA_MARGIN = 1.3
"""Ratio of the grasps tried per point to the requested successful ones."""
Quota = tuple[np.ndarray, int]
"""A mask ``(N,) bool`` of grasps, and the number of them that are requested."""


class GraspsStage:
    """Propose, filter, associate and select grasps.

    ``suffix`` is part of the artifact names and empty for the twin's first gripper. If no grasp fits, the first gripper rejects
    the object; any other gripper writes no proposals and the reason.
    """

    version = "12"
    reads: tuple[str, ...] = (
        "solid.npz",
        "hulls.npz",
        "points",
        "physical",
        "placements",
        "geometry?",
        "canonical.npz?",
    )

    def __init__(self, settings: GraspConfig, grasper: Grasper, gripper: Gripper, suffix: str = ""):
        """Take the settings, the grasper and the gripper."""
        self.name = f"grasps{suffix}"
        self.file, self.proposed = PROPOSALS.format(suffix), PROPOSED.format(suffix)
        self.writes: tuple[str, ...] = (self.file, self.proposed)
        self.may_reject, self.answered = not suffix, bool(suffix)
        if suffix:  # the grasp points of other gripper runs follow the first gripper's trials
            self.reads = (*self.reads, f"{GRASP_POINTS}?")
        self.settings, self.grasper, self.gripper = settings, grasper, gripper
        self.backend = grasper.name
        self.needs: Resource = grasper.needs
        self.model: str | None = f"{grasper.model or grasper.name} for {gripper.name} {gripper.sha256[:12]}"

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write ``proposals.npz`` and return the field ``proposals``. Raises Rejected if nothing fits the first gripper."""
        settings, points = self.settings, draft.field("points")
        if self.answered:
            points = points | draft.fields.get(GRASP_POINTS, {})
        request = grasp_request(draft, points, self.gripper, settings)
        screen = KINDS[self.gripper.kind].screen(request)
        if (chosen_link := ChosenLink.read(draft, self.gripper, settings.link)) is not None:
            request, screen = chosen_link.focused(request), chosen_link.screened(screen)
        kept = propose_in_rounds(request, self.grasper, screen, settings)
        kept = with_support_rounds(kept, request, self.grasper, screen, settings)
        kept, given = with_given(kept, read_given(draft), self.gripper, screen, request, settings.simulated)
        if not len(kept.proposals):
            answer = screen.why_none(kept.counts)
            if self.may_reject:
                raise answer
            self._write(folder / self.file, kept, np.empty(0, int), [], draft.seed)
            return {
                self.proposed: {
                    "none_because": {"reason": answer.reason, "detail": answer.detail},
                    "point_radius_m": settings.association_radius_m,
                }
            }
        nearest_m = kept.distance_m.min(1)
        association = associate(
            nearest_m[len(given) :],
            radius_m=settings.association_radius_m,
            enough=settings.simulated,
            object_size_m=float(np.linalg.norm(request.solid.extents)),
        )
        near = association.index + len(given)
        at_points = _at_points(kept, near, len(request.grasp_points_m), settings)
        quotas = [*support_quotas(kept, near, self.gripper, request.supports, settings), *at_points]
        chosen = np.concatenate([np.arange(len(given)), _likely(kept, near, quotas, settings.simulated)])
        self._write(folder / self.file, kept, chosen, given, draft.seed)
        octants = approach_octants(kept.proposals.gripper_to_object)
        return {
            self.proposed: {
                "proposed": len(kept.proposals),
                "proposed_by_filter": {
                    **kept.counts,
                    "after_association": len(near) + len(given),
                    "after_diversity": len(chosen),
                },
                "point_radius_m": settings.association_radius_m,
                "association_radius_m": association.radius_m,
                "association_radius_widened": association.widened,
                "share_beyond_3cm": float((nearest_m[chosen] > settings.association_radius_m).mean()),
                "approach_octants": len(np.unique(octants[chosen])),
                "octants_available": len(np.unique(octants)),
            }
        }

    def _write(
        self,
        path: Path,
        kept: ScreenedProposals,
        chosen: np.ndarray,
        given: list[str],
        seed: int,
    ) -> None:
        """Write the selected grasps, then the unfiltered sample.

        ``given`` are the proposers of the first of the selected grasps.
        """
        raw, count = kept.raw, min(self.settings.unfiltered, len(kept.raw))
        drawn = np.sort(np.random.default_rng(seed).choice(len(raw), count, replace=False))
        others = raw.take(drawn)
        both = GraspProposals.joined([kept.proposals.take(chosen), others])
        name = self.grasper.name
        proposer = [*given, *[name] * (len(chosen) - len(given)), *[name + UNFILTERED] * len(others)]
        np.savez(path, allow_pickle=False, **proposal_arrays(both, proposer))


def grasp_request(draft: Draft, points: dict[str, Any], gripper: Gripper, settings: GraspConfig) -> GraspRequest:
    """Build the grasper's request for an object with these points."""
    physical = draft.field("physical")
    return GraspRequest(
        solid=load_solid(draft.path("solid.npz")),
        hulls=load_hulls(draft.path("hulls.npz")),
        mass_kg=physical["mass_kg"]["value"],
        center_of_mass_m=np.array(physical["center_of_mass_m"]),
        object_friction=physical["friction_static"]["value"],
        gripper=gripper,
        focus_points_m=positions_of(points["functional"] + points["grasp"]),
        max_proposals=settings.raw_per_round,
        seed=draft.seed,
        grasp_points_m=positions_of(points["grasp"]),
        grasp_types=tuple(p["type"] for p in points["grasp"]),
        supports=pick_support_poses(draft.field("placements")),
    )


def positions_of(points: list[dict[str, Any]]) -> np.ndarray:
    """Return the positions ``(P, 3)`` of points."""
    return np.array([point["position_m"] for point in points], float).reshape(-1, 3)


def proposal_arrays(grasps: GraspProposals, proposer: list[str]) -> dict[str, np.ndarray]:
    """Return the arrays of ``proposals.npz`` for grasps and their proposers."""
    return {
        "gripper_to_object": grasps.gripper_to_object,
        "width_m": grasps.width_m,
        "depth_m": grasps.depth_m,
        "score": grasps.score,
        "proposer": np.array(proposer, str),
        **_hand_joints(grasps),
    }


def pick_support_poses(placements: list[dict[str, Any]]) -> tuple[np.ndarray, ...]:
    """Return ``object_to_plane (4, 4)`` of the placements from which robots will pick the object.

    These are the most probable stable placement, and the most probable upright one.
    """
    settled = sorted((p for p in placements if p["settled"]), key=lambda p: -p["probability"])
    upright = [p for p in settled if p["upright"]]
    first = [*settled[:1], *(p for p in upright[:1] if p is not settled[0])]
    return tuple(
        transform(rotation_from_quaternion_wxyz(np.array(p["quaternion_wxyz"])), np.array(p["position_m"]))
        for p in first
    )


def support_quotas(
    kept: ScreenedProposals, near: np.ndarray, gripper: Gripper, supports: Sequence[np.ndarray], settings: GraspConfig
) -> list[Quota]:
    """Request for each support its share of grasps near a point that clear the support plane and are fit, and a few others.

    Under a pan that lies on its rim only the handle is accessible, and all grasps there may drop the pan: many trials would not
    tell more than a few.
    """
    if not isinstance(gripper, ParallelGripper):
        return []
    is_near = np.zeros(len(kept.proposals), bool)
    is_near[near] = True
    radius_m = float("inf")  # proximity was decided by the association
    count = round(settings.on_support_share * settings.simulated)
    members = [is_near & on_support(kept, gripper, support, radius_m) for support in supports]
    few = min(HOPELESS_TRIES, count)
    return [quota for free in members for quota in ((free & kept.merits.fit, count), (free, few))]


def _at_points(kept: ScreenedProposals, near: np.ndarray, count: int, settings: GraspConfig) -> list[Quota]:
    """Request at each of the last ``count`` points (the grasp points) the grasps that should hold there, with a margin.

    Only fit grasps are requested: if all grasps there demand too much of the pads, many trials would not tell more than a few.
    """
    nearest = kept.distance_m[:, -count:].argmin(1)
    within = kept.distance_m[:, -count:].min(1) <= settings.association_radius_m
    is_near = np.zeros(len(kept.proposals), bool)
    is_near[near] = True
    wanted = min(round(QUOTA_MARGIN * settings.least_per_point), settings.simulated // (2 * count))
    return [(is_near & within & kept.merits.fit & (nearest == point), wanted) for point in range(count)]


def _likely(kept: ScreenedProposals, near: np.ndarray, quotas: list[Quota], count: int) -> np.ndarray:
    """Select ``count`` of the grasps at ``near``, with at least the requested number of each quota as far as available.

    Grasps that fill one quota count for the next. If the quotas exceed ``count`` in total, the first ones take precedence.
    """
    chosen = _select(kept, near, count)
    if all(member[chosen].sum() >= min(wanted, int(member.sum())) for member, wanted in quotas):
        return chosen
    sure = near[:0]
    for member, wanted in quotas:
        free = member.copy()
        free[sure] = False
        more = _select(kept, np.flatnonzero(free), min(wanted - int(member[sure].sum()), count - len(sure)))
        sure = np.concatenate([sure, more])
    rest = np.setdiff1d(near, sure)
    return np.sort(np.concatenate([sure, _select(kept, rest, count - len(sure))]))


def _select(kept: ScreenedProposals, among: np.ndarray, count: int) -> np.ndarray:
    if not len(among) or count <= 0:
        return among[:0]
    some = kept.proposals.take(among)
    return among[select_likely(some.gripper_to_object, some.depth_m, kept.merits.take(among), count)]


def _hand_joints(proposals: GraspProposals) -> dict[str, np.ndarray]:
    """Return the joint values as arrays for the table; empty for a gripper without several joints."""
    if proposals.joints_rad is None:
        return {}
    return dict(zip(JOINTS, proposals.joints_rad.transpose(1, 0, 2), strict=True))
