"""Summarize the grasps of a run: how many held, the results of second engine and repetitions, why others failed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from manitwin.twin.grasp_summary import GraspSummary, SecondOpinion
from manitwin.twin.record import TwinRecord


@dataclass(frozen=True)
class SecondOpinionTotals:
    """The second engine over all twins of a run.

    ``holds_share`` of the held grasps hold there too, ``failed_pass_share`` of those that failed; ``kappa`` is Cohen's over
    the jittered controls alone. None where nothing was tried.
    """

    held_tried: int
    holds_share: float | None
    failed_tried: int
    failed_pass_share: float | None
    jittered: int
    kappa: float | None


@dataclass(frozen=True)
class GraspTotals:
    """The grasps of all accepted twins of a run, first grippers only; ``robust`` of ``verified`` are robust."""

    twins: int
    simulated: int
    verified: int
    unfiltered_simulated: int
    unfiltered_held: int
    outcomes: dict[str, int]
    by_grasp_type: dict[str, dict[str, int]]
    by_region: dict[str, dict[str, int]]
    robust: int | None
    second_opinion: SecondOpinionTotals | None


def summarize_grasps(records: Iterable[TwinRecord]) -> GraspTotals:
    """Add up the grasps of the accepted twins among ``records``."""
    grasps = [record.grasps for record in records if record.grasps is not None]
    opinions = [g.second_opinion for g in grasps if g.second_opinion is not None]
    robustness = [g.robustness.robust for g in grasps if g.robustness is not None]
    by_type = _sum_tables(g.failure_table.by_grasp_type for g in grasps)
    return GraspTotals(
        twins=len(grasps),
        simulated=sum(g.simulated for g in grasps),
        verified=sum(g.verified for g in grasps),
        unfiltered_simulated=sum(g.unfiltered_simulated for g in grasps),
        unfiltered_held=sum(_unfiltered_held(g) for g in grasps),
        outcomes=dict(sorted(sum((Counter(row) for row in by_type.values()), Counter()).items())),
        by_grasp_type=by_type,
        by_region=_sum_tables(g.failure_table.by_region for g in grasps),
        robust=sum(robustness) if robustness else None,
        second_opinion=_add_opinions(opinions) if opinions else None,
    )


def grasp_lines(totals: GraspTotals) -> list[str]:
    """Write the totals as a person reads them, a line a fact."""
    if not totals.simulated:
        return []
    lines = [f"grasps: {totals.verified} of {totals.simulated} verified{_percent(totals.verified, totals.simulated)}"]
    if totals.unfiltered_simulated:
        share = _percent(totals.unfiltered_held, totals.unfiltered_simulated)
        lines[0] += f"; unfiltered {totals.unfiltered_held} of {totals.unfiltered_simulated}{share}"
    failed = ", ".join(f"{count} {outcome}" for outcome, count in totals.outcomes.items() if outcome != "held")
    lines.append(f"failures: {failed or 'none'}")
    for grasp_type, row in totals.by_grasp_type.items():
        held, tried = row.get("held", 0), sum(row.values())
        lines.append(f"  {grasp_type.replace('_', ' ')}: {held} of {tried}{_percent(held, tried)}")
    if totals.robust is not None:
        lines.append(f"robust: {totals.robust} of {totals.verified}{_percent(totals.robust, totals.verified)}")
    opinion = totals.second_opinion
    if opinion is not None:
        kappa = "undefined" if opinion.kappa is None else f"{opinion.kappa:.2f}"
        lines.append(
            f"second engine: holds {_share(opinion.holds_share)} of {opinion.held_tried} held, "
            f"{_share(opinion.failed_pass_share)} of {opinion.failed_tried} failed; "
            f"kappa {kappa} over {opinion.jittered} jittered"
        )
    return lines


def other_gripper_lines(records: Iterable[TwinRecord]) -> list[str]:
    """Write what the other grippers than the first hold of the accepted twins among ``records``, a line for each."""
    grasps = [record.grasps for record in records if record.grasps is not None]
    lines = []
    for name in dict.fromkeys(name for each in grasps for name in each.other_grippers):
        others = [each.other_grippers[name] for each in grasps if name in each.other_grippers]
        summaries = [other.summary for other in others if other.summary is not None]
        simulated, verified = sum(s.simulated for s in summaries), sum(s.verified for s in summaries)
        tried = f"{verified} of {simulated} verified{_percent(verified, simulated)}" if simulated else "nothing to try"
        line = f"with {name}: {tried}"
        reasons = Counter(other.reason for other in others if other.summary is None)
        if reasons:
            why = ", ".join(f"{count} {reason}" for reason, count in sorted(reasons.items(), key=str))
            line += f"; no grasps of {sum(reasons.values())} of {len(others)} twins ({why})"
        lines.append(line)
    return lines


def _unfiltered_held(grasps: GraspSummary) -> int:
    return round((grasps.unfiltered_success_rate or 0.0) * grasps.unfiltered_simulated)


def _sum_tables(tables: Iterable[dict[str, dict[str, int]]]) -> dict[str, dict[str, int]]:
    total: dict[str, Counter[str]] = {}
    for table in tables:
        for name, row in table.items():
            total.setdefault(name, Counter()).update(row)
    return {name: dict(sorted(counter.items())) for name, counter in sorted(total.items())}


def _add_opinions(opinions: list[SecondOpinion]) -> SecondOpinionTotals:
    held, failed = sum(o.held_tried for o in opinions), sum(o.failed_tried for o in opinions)
    holds = sum((o.holds_share or 0.0) * o.held_tried for o in opinions)
    passes = sum((o.failed_pass_share or 0.0) * o.failed_tried for o in opinions)
    count = sum(o.jittered for o in opinions)
    return SecondOpinionTotals(
        held_tried=held,
        holds_share=holds / held if held else None,
        failed_tried=failed,
        failed_pass_share=passes / failed if failed else None,
        jittered=count,
        kappa=_pooled_kappa(opinions, count),
    )


def _pooled_kappa(opinions: list[SecondOpinion], count: int) -> float | None:
    """Return Cohen's kappa of the table that all twins' controls make together."""
    if not count:
        return None
    first, second = sum(o.jittered_held for o in opinions), sum(o.jittered_hold_in_second_engine for o in opinions)
    p, q, observed = first / count, second / count, sum(o.jittered_agree for o in opinions) / count
    by_chance = p * q + (1 - p) * (1 - q)
    return None if np.isclose(by_chance, 1) else (observed - by_chance) / (1 - by_chance)


def _percent(part: int, whole: int) -> str:
    return f" ({100 * part / whole:.1f} %)" if whole else ""


def _share(value: float | None) -> str:
    return "none" if value is None else f"{100 * value:.1f} %"
