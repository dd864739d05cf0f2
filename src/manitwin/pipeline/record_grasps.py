"""The grasp table, best first, and the summary per gripper (paper, "Consolidated Output")."""

from __future__ import annotations

from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.config import Resource, SecondOpinionConfig
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.geometry.grasp_diversity import approach_octants
from manitwin.pipeline.grasp_regions import NOBODY, READS, PartedSolid, region_columns
from manitwin.pipeline.grasps import GRASP_POINTS, PROPOSED, UNFILTERED
from manitwin.pipeline.robustness import ROBUSTNESS, ROBUSTNESS_FILE, rank_values
from manitwin.pipeline.second_opinion import AGREEMENT, FAILS, NOT_TRIED, SECOND_OPINION
from manitwin.pipeline.tried_grasps import read_arrays, read_tried, tried_names
from manitwin.pipeline.verify import TRIAL
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.grasp_summary import FailureTable, GraspSummary, OtherGripper
from manitwin.twin.grasp_table import JITTERED, PART, POINTED, GripperRows, write_grasp_table

TABLE = "grasps.parquet"
NO_PART, NO_POINT = "no part", "no point"
"""Keys in outcome counts for grasps of no part and at no grasp point."""


class RecordGraspsStage:
    """Write ``grasps.parquet`` and the field ``grasps``, for the twin's first gripper and all others."""

    name = "record_grasps"
    version = "6"
    writes: tuple[str, ...] = (TABLE, "grasps")
    needs: Resource = "cpu"
    backend = "builtin"
    model: str | None = None

    def __init__(self, settings: SecondOpinionConfig, grippers: list[tuple[Gripper, str]], link: str | None = None):
        """Take the settings, and the grippers with their artifact suffixes, the first gripper first.

        ``link`` is the link to which grasps were restricted; None for no restriction.
        """
        self.settings, self.grippers, self.link = settings, grippers, link
        self.model = ", ".join(f"{gripper.name} {gripper.sha256[:12]}" for gripper, _ in grippers)
        self.model += "" if link is None else f", link {link}"
        kinds = [PROPOSED, TRIAL]
        optional = [SECOND_OPINION, AGREEMENT, ROBUSTNESS_FILE, ROBUSTNESS]
        self.reads: tuple[str, ...] = (
            "points",
            *READS,
            f"{GRASP_POINTS}?",
            *(name for _, suffix in grippers for name in tried_names(suffix)),
            *(name.format(suffix) for _, suffix in grippers for name in kinds),
            *(f"{name.format(suffix)}?" for _, suffix in grippers for name in optional),
        )

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write the table and return the summary. Raises Rejected if both engines must agree and do so on no grasp."""
        points = draft.fields.get(GRASP_POINTS) or draft.field("points")
        types = {point["id"]: point["type"] for point in points["grasp"]}
        types[NOBODY] = NO_POINT
        names = {NOBODY: NO_PART} | {part["id"]: part["name"] for part in draft.field("parts")}
        parts: list[dict[str, list[Any]]] = []
        summaries: list[GraspSummary | None] = []
        held_points: list[set[str]] = []
        for gripper, suffix in self.grippers:
            rows, controls = self._rows(draft, gripper, suffix)
            parts += [rows.columns(_best_first(rows)), *controls]
            summaries.append(_summary(draft, gripper, suffix, rows, types, names))
            chosen = (rows.outcome == "held") & ~_unfiltered(rows)
            if self.settings.require_agreement and not suffix and not chosen.any():
                raise _none_agreed(draft, rows)
            held_points.append(set(rows.proposals["grasp_point_id"][chosen].tolist()) - {NOBODY})
        write_grasp_table(folder / TABLE, parts)
        others = {
            gripper.name: _other(draft, suffix, summary, held_points[0], points)
            for (gripper, suffix), summary, points in zip(
                self.grippers[1:], summaries[1:], held_points[1:], strict=True
            )
        }
        first = summaries[0]
        if first is None:
            raise AssertionError("the first gripper has proposals, or the object was rejected")
        summary = first.model_copy(update={"other_grippers": others, "link": self.link})
        return {"grasps": summary.model_dump(mode="json")}

    def _rows(self, draft: Draft, gripper: Gripper, suffix: str) -> tuple[GripperRows, list[dict[str, list[Any]]]]:
        """Return the rows of the proposals, and the columns of the jittered controls if there are any."""
        proposals, verdicts = read_tried(draft, suffix)
        held = PartedSolid.read(draft, gripper, draft.field(PROPOSED.format(suffix))["point_radius_m"])
        points = draft.field("points") | (draft.fields.get(GRASP_POINTS) or {})
        proposals |= region_columns(proposals, held, points["functional"], points["grasp"])
        count = len(proposals["score"])
        ids = [f"{gripper.name}-{number:04d}" for number in range(count)]
        holds: list[bool | None] = [None] * count
        outcome = verdicts["outcome"]
        controls = []
        if SECOND_OPINION.format(suffix) in draft.paths:
            second = read_arrays(draft, SECOND_OPINION.format(suffix))
            holds = [None if value == NOT_TRIED else bool(value) for value in second["holds"]]
            if self.settings.require_agreement:
                refused = (outcome == "held") & (second["holds"] == FAILS)
                outcome = np.where(refused, second["outcome"], outcome)
            controls.append(_controls(gripper, proposals, second, ids))
        shares: list[float | None] = [None] * count
        trials: list[int | None] = [None] * count
        if ROBUSTNESS_FILE.format(suffix) in draft.paths:
            again = read_arrays(draft, ROBUSTNESS_FILE.format(suffix))
            shares = [float(h / n) if n else None for h, n in zip(again["held"], again["trials"], strict=True)]
            trials = [int(n) if n else None for n in again["trials"]]
        rows = GripperRows(
            gripper.name,
            proposals,
            outcome,
            verdicts["displacement_m"],
            verdicts["rotation_rad"],
            holds,
            shares,
            trials,
            ids,
        )
        return rows, controls


def _none_agreed(draft: Draft, rows: GripperRows) -> Rejected:
    """Return the rejection with the second engine's outcomes for grasps that held in the first."""
    held = (read_tried(draft, "")[1]["outcome"] == "held") & ~_unfiltered(rows)
    counted = ", ".join(f"{n} {outcome}" for outcome, n in sorted(Counter(rows.outcome[held].tolist()).items()))
    engine, second = (draft.field(name.format(""))["engine"] for name in (TRIAL, AGREEMENT))
    return Rejected("none_held", f"of {held.sum()} grasps that held in {engine} none holds in {second}: {counted}")


def _unfiltered(rows: GripperRows) -> np.ndarray:
    return np.char.endswith(rows.proposals["proposer"], UNFILTERED)


def _best_first(rows: GripperRows) -> np.ndarray:
    """Return the row order: held before failed, robust before fragile, unfiltered last; else as proposed."""
    trials = np.array([n or 0 for n in rows.robustness_trials])
    held = np.array([round((share or 0.0) * n) for share, n in zip(rows.robustness, trials, strict=True)], int)
    rank = rank_values(held, trials)
    return np.lexsort((np.arange(len(rank)), -rank, rows.outcome != "held", _unfiltered(rows)))


def _controls(
    gripper: Gripper, proposals: dict[str, np.ndarray], second: dict[str, np.ndarray], ids: list[str]
) -> dict[str, list[Any]]:
    of = second["jittered_of"]
    moved = {name: values[of] for name, values in proposals.items()}
    moved["gripper_to_object"] = second["jittered_gripper_to_object"]
    moved["proposer"] = np.char.add(moved["proposer"], JITTERED)
    for name in POINTED:  # the association does not apply after the move
        moved[name] = np.full(len(of), NOBODY)
    rows = GripperRows(
        gripper.name,
        moved,
        second["jittered_outcome"],
        second["jittered_displacement_m"],
        second["jittered_rotation_rad"],
        [bool(value) for value in second["jittered_holds"]],
        [None] * len(of),
        [None] * len(of),
        [f"{ids[i]}{JITTERED}" for i in of],
    )
    return rows.columns(np.arange(len(of)))


def _summary(
    draft: Draft, gripper: Gripper, suffix: str, rows: GripperRows, types: dict[str, str], names: dict[str, str]
) -> GraspSummary | None:
    proposed = draft.field(PROPOSED.format(suffix))
    if "none_because" in proposed:
        return None
    unfiltered = _unfiltered(rows)
    held = rows.outcome == "held"
    verified = held & ~unfiltered
    return GraspSummary(
        gripper=gripper.name,
        gripper_sha256=gripper.sha256,
        proposed=proposed["proposed"],
        proposed_by_filter=proposed["proposed_by_filter"],
        simulated=int((~unfiltered).sum()),
        verified=int(verified.sum()),
        success_rate=float(held[~unfiltered].mean()),
        unfiltered_simulated=int(unfiltered.sum()),
        unfiltered_success_rate=float(held[unfiltered].mean()) if unfiltered.any() else None,
        failures=dict(sorted(Counter(rows.outcome[~held & ~unfiltered].tolist()).items())),
        approach_octants=len(np.unique(approach_octants(rows.proposals["gripper_to_object"][verified]))),
        file=TABLE,
        association_radius_m=proposed["association_radius_m"],
        association_radius_widened=proposed["association_radius_widened"],
        share_beyond_3cm=proposed["share_beyond_3cm"],
        trial=draft.field(TRIAL.format(suffix)),
        failure_table=FailureTable(
            by_grasp_type=_outcomes_by(rows, "grasp_point_id", types, ~unfiltered),
            by_region=_outcomes_by(rows, PART, names, ~unfiltered),
        ),
        second_opinion=draft.fields.get(AGREEMENT.format(suffix)),
        robustness=draft.fields.get(ROBUSTNESS.format(suffix)),
    )


def _outcomes_by(rows: GripperRows, column: str, names: dict[str, str], which: np.ndarray) -> dict[str, dict[str, int]]:
    """Count the outcomes of the rows ``which`` by the name of the part or point held."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for point, outcome in zip(rows.proposals[column][which].tolist(), rows.outcome[which].tolist(), strict=True):
        counts[names[point]][outcome] += 1
    return {name: dict(sorted(counter.items())) for name, counter in sorted(counts.items())}


def _other(
    draft: Draft, suffix: str, summary: GraspSummary | None, first_holds: set[str], holds: set[str]
) -> OtherGripper:
    because = draft.field(PROPOSED.format(suffix)).get("none_because") or {}
    return OtherGripper(
        summary=summary,
        reason=because.get("reason"),
        detail=because.get("detail"),
        transferable=len(first_holds),
        transferred=len(first_holds & holds),
    )
