"""Trials at grasp points: ensure that enough grasps hold at every point, explain a shortfall, or replace the point.

The selection of grasps is spread over the object, so that a mug's handle may get three trials of a hundred. If fewer grasps
hold at a point than requested, more are proposed there and tried. A point at which still none holds is withdrawn and replaced
by the next best point with successful grasps. Without such a point it is kept with low confidence.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from manitwin.config import GraspConfig, Resource, VerifyConfig
from manitwin.engine.stage import Draft
from manitwin.models.graspers.protocol import Grasper, GraspProposals
from manitwin.physics.trial import GraspTrial, TrialResult
from manitwin.pipeline.grasp_regions import READS, PartedSolid
from manitwin.pipeline.grasps import GRASP_POINTS, PROPOSALS, UNFILTERED, grasp_request, proposal_arrays
from manitwin.pipeline.gripper_kinds import KINDS
from manitwin.pipeline.link_grasps import ChosenLink
from manitwin.pipeline.object_state import JOINTS, load_body
from manitwin.pipeline.point_search import PointSearch, TriedGrasps
from manitwin.pipeline.tried_grasps import POINT_PROPOSALS, POINT_VERDICTS, read_arrays
from manitwin.pipeline.verify import VERDICTS, confirmation, result_arrays, trial_settings
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.point_records import GraspPoint

DISPROVED = 0.1
"""The confidence of a grasp point at which no grasp holds."""


class PointTrialsStage:
    """Try more grasps at points with too few successes; write all rows again with the ids of the remaining points.

    Only for the twin's first gripper: other grippers report which of its points transfer to them.
    """

    name: ClassVar[str] = "point_trials"
    version: ClassVar[str] = "13"
    reads: ClassVar[tuple[str, ...]] = (
        *READS, "hulls.npz", "points", "spare_grasp_points", "physical", "placements", "geometry?", "canonical.npz?",
        PROPOSALS.format(""), VERDICTS.format(""),
    )  # fmt: skip
    writes: ClassVar[tuple[str, ...]] = (POINT_PROPOSALS, POINT_VERDICTS, GRASP_POINTS)

    def __init__(
        self, settings: GraspConfig, verify: VerifyConfig, grasper: Grasper, trial: GraspTrial, gripper: Gripper
    ):
        """Take the settings of grasps and trials, the grasper, the engine and the gripper."""
        self.settings, self.verify = settings, verify
        self.grasper, self.trial, self.gripper = grasper, trial, gripper
        self.backend = trial.name
        self.needs: Resource = grasper.needs
        self.model: str | None = (
            f"{grasper.model or grasper.name} for {gripper.name} {gripper.sha256[:12]}, {verify.model_dump_json()}"
            f"{confirmation(trial)}"
        )

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write all rows and return the field ``grasp_points``: the remaining and the withdrawn points."""
        first, verdicts = read_arrays(draft, PROPOSALS.format("")), read_arrays(draft, VERDICTS.format(""))
        chosen = np.flatnonzero(~np.char.endswith(first["proposer"], UNFILTERED))
        grasps, points = grasps_of(first), draft.field("points")
        request = grasp_request(draft, points, self.gripper, self.settings)
        body, settings = load_body(draft), trial_settings(self.verify, self.gripper)

        def attempt(some: GraspProposals) -> list[TrialResult]:
            joints = {} if some.joints_rad is None else {"joints_rad": some.joints_rad}
            return self.trial.run(body, self.gripper, some.gripper_to_object, settings, **joints)

        tried = TriedGrasps(grasps.take(chosen), verdicts["outcome"][chosen].tolist())
        screen = KINDS[self.gripper.kind].screen(request)
        chosen_link = ChosenLink.read(draft, self.gripper, self.settings.link)
        if chosen_link is not None:
            screen = chosen_link.screened(screen)
        held = PartedSolid.read(draft, self.gripper, self.settings.association_radius_m)
        search = PointSearch(request, self.grasper, screen, self.settings, held, tried, attempt)
        answered = resolve_grasp_points(
            search,
            [GraspPoint(**point) for point in points["grasp"]],
            [GraspPoint(**point) for point in draft.field("spare_grasp_points")],
        )
        self._write(folder, first, verdicts, search)
        return {GRASP_POINTS: answered}

    def _write(
        self,
        folder: Path,
        first: dict[str, np.ndarray],
        verdicts: dict[str, np.ndarray],
        search: PointSearch,
    ) -> None:
        before, results = grasps_of(first), search.results
        more = search.tried.grasps.take(np.arange(len(search.tried.grasps) - len(results), len(search.tried.grasps)))
        proposer = [*first["proposer"].tolist(), *[self.grasper.name] * len(more)]
        arrays = proposal_arrays(GraspProposals.joined([before, more]), proposer)
        np.savez(folder / POINT_PROPOSALS, allow_pickle=False, **arrays)
        joined = {name: np.concatenate([verdicts[name], new]) for name, new in result_arrays(results).items()}
        np.savez(folder / POINT_VERDICTS, allow_pickle=False, **joined)


def resolve_grasp_points(
    search: PointSearch, points: list[GraspPoint], spares: list[GraspPoint]
) -> dict[str, list[dict[str, Any]]]:
    """Search wherever too few grasps hold; return the points with the number of successful grasps, and the withdrawn points."""
    searched: set[str] = set()
    number = len(points)
    withdrawn: list[GraspPoint] = []
    spares = list(spares)
    _search_where_short(search, points, searched, points)
    for place, point in enumerate(list(points)):
        if not search.outcomes_at(point, points)["held"]:
            _search_where_short(search, points, searched, [point])  # a new point may have taken over its grasps
        if search.outcomes_at(point, points)["held"] or not search.has_shortfall(point, points):
            continue
        others = [p for p in points if p.id != point.id]
        spare = _next_best(search, f"g{number}", others, spares)
        if spare is not None:
            reason = search.shortfall(point, points)
            confidence = min(DISPROVED, point.confidence)
            withdrawn.append(point.model_copy(update={"confidence": confidence, "verified": 0, "shortfall": reason}))
            points, number = [*points[:place], spare, *points[place + 1 :]], number + 1
            if spare.candidate in search.passed:
                searched.add(spare.id)
    _search_where_short(search, points, searched, points)  # a new point may now be the nearest to grasps of another one
    return {
        "grasp": [_counted(search, point, points).model_dump() for point in points],
        "withdrawn": [point.model_dump() for point in withdrawn],
    }


def _next_best(search: PointSearch, name: str, others: list[GraspPoint], spares: list[GraspPoint]) -> GraspPoint | None:
    """Take the first spare point at which enough grasps hold, else the one with the most successes; None if there is none."""
    best, most = None, 0
    spares.sort(
        key=lambda spare: search.has_shortfall(spare, others)
    )  # points with enough successful grasps already go first
    while spares:
        spare = spares.pop(0).model_copy(update={"id": name})
        if search.has_shortfall(spare, others):
            search.search(spare, others)
        held = search.outcomes_at(spare, others)["held"]
        if not search.has_shortfall(spare, others):
            return spare
        if held > most:
            best, most = spare, held
    return best


def _search_where_short(
    search: PointSearch, points: list[GraspPoint], searched: set[str], some: list[GraspPoint]
) -> None:
    """Search at those of ``some`` points at which too few grasps hold and that have not been searched."""
    for point in some:
        if point.id not in searched and search.has_shortfall(point, points):
            searched.add(point.id)
            search.search(point, points)


def _counted(search: PointSearch, point: GraspPoint, points: list[GraspPoint]) -> GraspPoint:
    held = search.outcomes_at(point, points)["held"]
    update = {"verified": held, "shortfall": search.shortfall(point, points)}
    return point.model_copy(update=update if held else update | {"confidence": min(DISPROVED, point.confidence)})


def grasps_of(arrays: dict[str, np.ndarray]) -> GraspProposals:
    """Return the grasps in ``proposals.npz``."""
    joints = np.stack([arrays[name] for name in JOINTS], axis=1) if JOINTS[0] in arrays else None
    return GraspProposals(arrays["gripper_to_object"], arrays["width_m"], arrays["depth_m"], arrays["score"], joints)
