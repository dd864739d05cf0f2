"""A twin as a page of text."""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

from manitwin.cli.console import escape_cell_text
from manitwin.pipeline.quality import rehearsed_words
from manitwin.twin.grasp_summary import GraspSummary, OtherGripper, SecondOpinion
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.point_records import FunctionalPoint
from manitwin.twin.proportions import wilson_interval
from manitwin.twin.record import TwinRecord
from manitwin.twin.record_values import Estimate
from manitwin.twin.resting import RestingPose, resting_poses


def estimate_text(estimate: Estimate, unit: str = "") -> str:
    """Write an Estimate as a person reads it: value, interval, source."""
    return f"{estimate.value:.3g}{unit} ({estimate.low:.3g} to {estimate.high:.3g}, {estimate.source})"


def print_summary(twin: Twin, console: Console) -> None:
    """Print what a twin is, weighs, is for and how it may be held."""
    record = twin.record
    head = record.language.caption if record.language else record.name or "unnamed"
    console.print(f"{record.twin_id}  {record.status}  {head}", style="bold", markup=False)
    if record.provenance.rehearsed:
        console.print(f"REHEARSAL: {rehearsed_words(record.provenance.rehearsed)}", style="bold red", markup=False)
    if record.rejection is not None:
        console.print(f"{record.rejection.stage}: {record.rejection.reason}: {record.rejection.detail}", markup=False)
    table = Table(show_header=False, box=None, pad_edge=False)
    for name, value in _rows(record):
        table.add_row(escape_cell_text(name), escape_cell_text(value))  # words of a model
    console.print(table)
    failed = [check for check in record.quality.checks if check.passed is not True]
    for check in failed:
        verdict = "not judged" if check.passed is None else "finding"
        console.print(f"{verdict}: {check.name}: {check.message}", markup=False)


def _rows(record: TwinRecord) -> list[tuple[str, str]]:
    rows = [("source", f"{record.source.kind} {record.source.file}, licence {record.source.license}")]
    if record.naming is not None:
        guess = record.naming.name or "unknown"
        rows.append(("named", f"{guess}, probability {estimate_text(record.naming.probability)}"))
    if record.physical is not None:
        physical = record.physical
        centimetres = " x ".join(f"{100 * side:.1f}" for side in physical.extents_m)
        center = ", ".join(str(round(1000 * x)) for x in physical.center_of_mass_m)
        moments = ", ".join(f"{m:.2e}" for m in np.linalg.eigvalsh(np.array(physical.inertia_kg_m2)))
        rows += [
            ("size", f"{centimetres} cm (scaled by {physical.scale_applied:.4g})"),
            ("mass", estimate_text(physical.mass_kg, " kg")),
            ("friction", estimate_text(physical.friction_static)),
            ("material", physical.material),
            ("centre of mass", f"({center}) mm, {physical.mass_distribution}"),
            ("moments", f"{moments} kg m2"),
        ]
    if record.mesh is not None:
        hulls = record.mesh.hulls
        rows.append(
            (
                "mesh",
                f"{record.mesh.faces} faces, {hulls.count} hulls, error p95 {1000 * hulls.surface_error_p95_m:.1f} mm",
            )
        )
        rows += [("repair", repair) for repair in record.mesh.repairs]
    if record.points is not None:
        rows += [(f"point {p.id}", f"{p.label}: {p.description}; {_frame_words(p)}") for p in record.points.functional]
        rows += [(f"point {p.id}", f"{p.type}: {p.scenario}") for p in record.points.grasp]
    if record.grasps is not None:
        rows += _grasp_rows(record.grasps)
    poses = resting_poses(record.placements or [])
    return rows + [("rests" if pose.placement.settled else "did not settle", _resting(pose)) for pose in poses]


def _frame_words(point: FunctionalPoint) -> str:
    """Say what a point's frame is of: 'opening of 41 mm radius', 'edge of 92 mm'."""
    frame = point.frame
    if frame is None:
        return "no frame"
    of = "" if frame.kind in ("edge", "axis") else " radius"
    return f"{frame.kind} of {1000 * frame.size_m:.0f} mm{of} ({frame.source})"


def _resting(pose: RestingPose) -> str:
    way: str = pose.rest.replace("_", " ")
    if pose.side_down is not None:
        way = f"lying on its {pose.side_down} side, {pose.tilt_deg:.0f} degrees from upright"
    placement = pose.placement
    return f"{way}, probability {placement.probability:.2f}, radius {100 * placement.collision_radius_m:.1f} cm"


def _grasp_rows(grasps: GraspSummary) -> list[tuple[str, str]]:
    failures = ", ".join(f"{number} {outcome}" for outcome, number in sorted(grasps.failures.items())) or "none"
    unfiltered = (
        "not tried" if grasps.unfiltered_success_rate is None else f"{100 * grasps.unfiltered_success_rate:.0f} %"
    )
    rows = [
        ("grasps", f"{grasps.verified} of {grasps.simulated} verified with {grasps.gripper} (unfiltered {unfiltered})"),
        ("failures", failures),
    ]
    table = grasps.failure_table
    rows += [
        (f"held by {name}", _outcome_text(row))
        for name, row in (*table.by_grasp_type.items(), *table.by_region.items())
    ]
    if grasps.robustness is not None:
        again = grasps.robustness
        share = f"{100 * again.robust_share:.0f} %"
        median = "none tried" if again.median is None else f"median {again.median:.2f}"
        rows.append(("robustness", f"{again.robust} hold in {share} of their perturbed trials, {median}"))
    if grasps.second_opinion is not None:
        rows.append(("second engine", _opinion(grasps.second_opinion, grasps.verified)))
    for name, other in grasps.other_grippers.items():
        rows.append((f"with {name}", _other_gripper(other)))
    return rows


def _outcome_text(outcomes: dict[str, int]) -> str:
    others = ", ".join(f"{number} {outcome}" for outcome, number in outcomes.items() if outcome != "held")
    return f"{outcomes.get('held', 0)} of {sum(outcomes.values())}" + (f" ({others})" if others else "")


def _opinion(opinion: SecondOpinion, verified: int) -> str:
    holds = "nothing held to try" if opinion.holds_share is None else f"holds {100 * opinion.holds_share:.0f} % of them"
    if opinion.holds_share is not None and opinion.held_tried < verified:
        low, high = wilson_interval(round(opinion.holds_share * opinion.held_tried), opinion.held_tried)
        holds += f" ({100 * low:.0f} to {100 * high:.0f} %, by a sample of {opinion.held_tried})"
    kappa = "undefined" if opinion.kappa is None else f"{opinion.kappa:.2f}"
    return f"{opinion.engine} {holds}; kappa {kappa} over {opinion.jittered} jittered"


def _other_gripper(other: OtherGripper) -> str:
    if other.summary is None:
        return f"none: {other.detail}"
    engines = other.summary.trial.engine + (" alone" if other.summary.second_opinion is None else "")
    held = f"{other.summary.verified} of {other.summary.simulated} verified in {engines}"
    return f"{held}; holds by {other.transferred} of {other.transferable} grasp points"
