"""Rounds of grasp proposals: propose, filter, and associate with the selected points.

Source: paper, "Grasp Proposal Generation" and "Spatial Filtering and Semantic Association". The grasper is called in rounds
until enough proposals are near the points. Further rounds look for grasps that clear the support plane. Grasps of an imported
asset are added to the proposals and tried like all others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from manitwin.config import GraspConfig
from manitwin.geometry.grasp_diversity import fingertips
from manitwin.models.graspers.protocol import Grasper, GraspProposals, GraspRequest, Screen
from manitwin.physics.grasp_filters import lowest_points_m, retract_from_plane
from manitwin.physics.grasp_selection import Merits
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.twin.import_record import ImportRecord

GROWTH = 1.5
FIRST_SUPPORT_SEED = 1000
"""The first seed of rounds for supports; other rounds start at 0."""
HOPELESS_ROUNDS = 4
"""Rounds without a single success after which no more are tried, e.g. if a plate's rim is too low for the hand."""


def distances_to_grasps(points_m: np.ndarray, grasps: GraspProposals) -> np.ndarray:
    """Return the distances ``(N, P)`` of points ``(P, 3)`` from the line segments between the contacts of grasps.

    Selected points and contacts lie on the surface, whereas the point between the fingertips is inside the object: measured
    from there, a wide body would be far from its own faces.
    """
    closing = grasps.gripper_to_object[:, :3, 0]
    offset = points_m[None] - fingertips(grasps.gripper_to_object, grasps.depth_m)[:, None]
    along = np.einsum("npi,ni->np", offset, closing)
    nearest = np.clip(along, -grasps.width_m[:, None] / 2, grasps.width_m[:, None] / 2)
    return np.linalg.norm(offset - nearest[..., None] * closing[:, None], axis=2)


@dataclass(frozen=True)
class Association:
    """The association radius used, whether it was widened, and the indices of the grasps within it."""

    radius_m: float
    widened: bool
    index: np.ndarray


def associate(distance_m: np.ndarray, *, radius_m: float, enough: int, object_size_m: float) -> Association:
    """Keep the grasps near a point; if they are too few, widen the radius by half repeatedly, up to the object's size.

    ``distance_m (N,)`` is each grasp's distance from its nearest point.
    """
    used = radius_m
    while (distance_m <= used).sum() < enough and used < object_size_m:
        used = min(used * GROWTH, object_size_m)
    return Association(used, used > radius_m, np.flatnonzero(distance_m <= used))


@dataclass(frozen=True)
class ScreenedProposals:
    """Grasps that passed the filters, their merits, and their distances from each point ``(N, P)`` m.

    ``raw`` are the first round's proposals before filtering; ``counts`` are the numbers of grasps after each filter.
    """

    proposals: GraspProposals
    merits: Merits
    distance_m: np.ndarray
    raw: GraspProposals
    counts: dict[str, int]

    @classmethod
    def screened(cls, raw: GraspProposals, screen: Screen, points_m: np.ndarray) -> ScreenedProposals:
        """Return the proposals that pass a screen."""
        left = screen(raw)
        return cls(left.proposals, left.merits, distances_to_grasps(points_m, left.proposals), raw, left.counts)

    @classmethod
    def joined(cls, parts: list[ScreenedProposals], raw: GraspProposals) -> ScreenedProposals:
        """Return the concatenated grasps of all parts; ``raw`` are those of the whole."""
        return cls(
            GraspProposals.joined([part.proposals for part in parts]),
            Merits.joined([part.merits for part in parts]),
            np.concatenate([part.distance_m for part in parts]),
            raw,
            {name: sum(part.counts[name] for part in parts) for name in parts[0].counts},
        )


def propose_in_rounds(
    request: GraspRequest, grasper: Grasper, screen: Screen, settings: GraspConfig
) -> ScreenedProposals:
    """Propose and filter until ``near_enough`` grasps are within the radius of a point, or the rounds are used up.

    More rounds are made while fewer grasps than will be simulated are likely to hold. While fewer than that have passed the
    filters at all, the next round also proposes around those that have.
    """
    points = request.focus_points_m
    rounds: list[ScreenedProposals] = []
    total = near = likely = 0
    while len(rounds) < _most(grasper, settings, enough=likely >= settings.simulated):
        seed = int(np.random.SeedSequence([request.seed, len(rounds)]).generate_state(1)[0])
        focus = points if not rounds or total >= settings.simulated else _around(points, rounds)
        raw = grasper.propose(replace(request, focus_points_m=focus, seed=seed))
        rounds.append(ScreenedProposals.screened(raw, screen, points))
        total += len(rounds[-1].proposals)
        likely += int(rounds[-1].merits.likely().sum())
        near += int((rounds[-1].distance_m.min(1) <= settings.association_radius_m).sum())
        if near >= settings.near_enough or total >= settings.max_proposals:
            break
    kept = ScreenedProposals.joined(rounds, rounds[0].raw)
    first = np.arange(min(total, settings.max_proposals))
    return replace(
        kept,
        proposals=kept.proposals.take(first),
        merits=kept.merits.take(first),
        distance_m=kept.distance_m[first],
    )


def _most(grasper: Grasper, settings: GraspConfig, *, enough: bool) -> int:
    most = settings.rounds if enough else settings.scarce_rounds
    return most if grasper.rounds is None else min(most, grasper.rounds)


def _around(points: np.ndarray, rounds: list[ScreenedProposals]) -> np.ndarray:
    tips = [fingertips(some.proposals.gripper_to_object, some.proposals.depth_m) for some in rounds]
    return np.concatenate([points, *tips])


def with_support_rounds(
    kept: ScreenedProposals, request: GraspRequest, grasper: Grasper, screen: Screen, settings: GraspConfig
) -> ScreenedProposals:
    """Propose until enough grasps near the points clear each of ``request.supports``, or the rounds are used up.

    Proposals that would penetrate a support are retracted along their approach. Nothing is changed if there are enough already,
    if there are no grasps, or if the gripper is not parallel. A grasper with limited rounds is called at most once more.
    """
    gripper = request.gripper
    if not isinstance(gripper, ParallelGripper) or not len(kept.proposals):
        return kept
    wanted = round(settings.on_support_share * settings.simulated)
    most = settings.scarce_rounds if grasper.rounds is None else 1
    for place, support in enumerate(request.supports):
        for number in range(most):
            found = on_support(kept, gripper, support, settings.association_radius_m).sum()
            if found >= wanted or (number >= HOPELESS_ROUNDS and not found):
                break
            words = [request.seed, FIRST_SUPPORT_SEED * (place + 1) + number]
            seed = int(np.random.SeedSequence(words).generate_state(1)[0])
            raw = _clear_of(support, gripper, grasper.propose(replace(request, seed=seed)))
            if len(raw):
                kept = ScreenedProposals.joined(
                    [kept, ScreenedProposals.screened(raw, screen, request.focus_points_m)], kept.raw
                )
    return kept


def on_support(kept: ScreenedProposals, gripper: ParallelGripper, support: np.ndarray, radius_m: float) -> np.ndarray:
    """Return which grasps ``(N,)`` are near a point and clear a support."""
    near = kept.distance_m.min(1) <= radius_m if len(kept.proposals) else np.zeros(0, bool)
    return near & (lowest_points_m(gripper, kept.proposals.gripper_to_object, support) > 0)


def _clear_of(support: np.ndarray, gripper: ParallelGripper, raw: GraspProposals) -> GraspProposals:
    """Return the proposals whose hand clears a support, and others retracted until it does."""
    clear = np.flatnonzero(lowest_points_m(gripper, raw.gripper_to_object, support) > 0)
    poses, index = retract_from_plane(gripper, raw.gripper_to_object, support)
    return GraspProposals.joined([raw.take(clear), replace(raw.take(index), gripper_to_object=poses)])


def given_proposals(given: ImportRecord, gripper: Gripper, most: int) -> GraspProposals | None:
    """Return an asset's grasps for a gripper, those stated to hold first, at most ``most``; None if there are none.

    Contact frames with approach and closing directions are grasps for any parallel gripper, with its fingertips at the frame.
    Hands with several joints get none, as assets do not state joint values.
    """
    if gripper.kind == "multi_finger":
        return None
    poses: list[np.ndarray] = []
    widths: list[float] = []
    depths: list[float] = []
    scores: list[float] = []
    for grasps in given.grasps:
        if grasps.gripper == gripper.name:
            order = np.argsort(~np.array(grasps.held), kind="stable")
            poses += [np.array(grasps.gripper_to_object[i]) for i in order]
            widths += [grasps.width_m[i] for i in order]
            depths += [grasps.depth_m[i] for i in order]
            scores += [float(grasps.held[i]) for i in order]
    if gripper.kind == ParallelGripper.kind:  # a contact frame with approach and closing direction is sufficient
        frames = [p for p in given.grasp_points if p.approach is not None and p.closing is not None]
        poses += [_at_contact(np.array(p.position_m), p.approach, p.closing, gripper.tip_depth_m) for p in frames]
        widths += [gripper.opening_m] * len(frames)
        depths += [gripper.tip_depth_m] * len(frames)
        scores += [1.0] * len(frames)
    if not poses:
        return None
    some = slice(0, most)
    return GraspProposals(np.array(poses[some]), np.array(widths[some]), np.array(depths[some]), np.array(scores[some]))


def with_given(
    kept: ScreenedProposals,
    given: ImportRecord | None,
    gripper: Gripper,
    screen: Screen,
    request: GraspRequest,
    most: int,
) -> tuple[ScreenedProposals, list[str]]:
    """Prepend the asset's grasps that pass the filters to the proposals; return all, and the proposers of the former."""
    proposals = None if given is None else given_proposals(given, gripper, most)
    if given is None or proposals is None:
        return kept, []
    passed = ScreenedProposals.screened(proposals, screen, request.focus_points_m)
    if not len(passed.proposals):
        return kept, []
    return ScreenedProposals.joined([passed, kept], kept.raw), [given.source] * len(passed.proposals)


def _at_contact(
    position_m: np.ndarray, approach: list[float] | None, closing: list[float] | None, tip_depth_m: float
) -> np.ndarray:
    """Return ``gripper_to_object`` with the fingertips at a contact frame: Z along the approach, X along the closing
    direction.
    """
    z = np.array(approach)
    x = np.array(closing) - (np.array(closing) @ z) * z
    # closing along the approach is invalid; any perpendicular direction lets the filters reject it
    if np.linalg.norm(x) < 1e-6:
        x = np.eye(3)[int(np.abs(z).argmin())] - z * z[int(np.abs(z).argmin())]
    x = x / np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    pose[:3, 3] = position_m - tip_depth_m * z
    return pose
