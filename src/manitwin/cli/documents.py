"""What commands print with ``--json``: documents of plain values, whose keys docs/json.md names."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from manitwin.api import BuildReport
    from manitwin.cli.causes import Cause
    from manitwin.cli.dry_run import Plan
    from manitwin.engine.ledger.progress import ItemStory, Progress
    from manitwin.episodes.collect import Collected
    from manitwin.episodes.retirement import Retirement
    from manitwin.pipeline.build_item import ItemResult
    from manitwin.pipeline.dataset_run import RunReport
    from manitwin.pipeline.folder_listing import FolderListing
    from manitwin.scenes.layouts.layouts_run import LayoutTotals
    from manitwin.twin.loaded_twin import Twin
    from manitwin.twin.resting import RestingPose

Document = dict[str, Any]


def build_document(report: BuildReport, out: str, causes: list[Cause]) -> Document:
    """Return what became of every input of a build."""
    from manitwin.cli.run_summary import summarize_grasps

    return {
        "out": out,
        "counts": {status: report.count(status) for status in ("accepted", "rejected", "unfinished")},
        "items": [_item(result) for result in report.results],
        "grasps": asdict(summarize_grasps(report.records())),
        "causes": _causes(causes),
        "remarks": report.remarks,
        "folders": [_folder(listing) for listing in report.folders],
        "exit_status": report.exit_code,
    }


def run_document(report: RunReport, place: str, causes: list[Cause]) -> Document:
    """Return how a run ended: items of the whole data set by state."""
    return {
        "out": place,
        "counts": _by_state(report.counts),
        "left_waiting": report.left,
        "stopped": report.stopped,
        "causes": _causes(causes),
        "remarks": report.remarks,
        "folders": [_folder(listing) for listing in report.folders],
        "exit_status": report.exit_code,
    }


def layouts_document(report: RunReport, place: str, causes: list[Cause], totals: LayoutTotals) -> Document:
    """Return what became of layouts, over all that are there."""
    return {
        **run_document(report, place, causes),
        **asdict(totals),
        "acceptance": totals.acceptance,
    }


def trajectories_document(
    report: RunReport,
    place: str,
    causes: list[Cause],
    collected: Collected | None,
    retired: list[Retirement],
    fresh: int,
) -> Document:
    """Return what became of batches, attempts and grasps; nothing is ``collected`` where a batch is missing."""
    attempts = None if collected is None else asdict(collected.totals)
    return {
        **run_document(report, place, causes),
        "attempts": attempts,
        "failing_grasps": [{**asdict(each), "failed": each.failed} for each in retired],
        "retired_now": fresh,
    }


def status_document(progress: Progress, place: str, causes: list[Cause]) -> Document:
    """Return how far a data set is."""
    return {"out": place, **asdict(progress), "causes": _causes(causes)}


def story_document(story: ItemStory, place: str) -> Document:
    """Return what became of one item."""
    return {"out": place, "item": asdict(story)}


def show_document(twin: Twin) -> Document:
    """Return a twin's record, how it rests in words, and what was found about it."""
    from manitwin.twin.resting import resting_poses

    record = twin.record
    return {
        "folder": str(twin.folder),
        "record": record.model_dump(mode="json"),
        "placements": [_resting(pose) for pose in resting_poses(record.placements or [])],
        "findings": [check.model_dump(mode="json") for check in record.quality.checks if check.passed is not True],
    }


def plan_document(plan: Plan, place: str) -> Document:
    """Return what a dry run says."""
    from manitwin.cli.dry_run import PLANNED_STATES

    return {
        "out": place,
        "items": [
            {
                "file": planned.item.file, "text": planned.item.text, "name": planned.item.name, "kind": planned.kind,
                "units": planned.item.units, "up": planned.item.up, "twin_id": planned.twin_id, "state": planned.state,
                "detail": planned.detail,
            }
            for planned in plan.items
        ],
        "counts": {state: plan.count(state) for state in PLANNED_STATES},
        "estimate": {
            "cpu_seconds": plan.cpu_s,
            "cost_usd": plan.cost_usd,
            "each": {
                kind: {"cpu_seconds": rate.cpu_s, "source": rate.source, "cost_usd": plan.usd_each[kind]}
                for kind, rate in plan.rates.items()
            },
        },
        "remarks": plan.remarks,
    }  # fmt: skip


def _item(result: ItemResult) -> Document:
    item = result.item
    return {
        "file": item.file,
        "text": item.text,
        "name": item.name,
        "twin_id": result.twin_id,
        "status": result.status,
        "reason": result.reason,
        "detail": result.detail,
        "folder": None if result.folder is None else str(result.folder),
        "reused": result.reused,
    }


def _resting(pose: RestingPose) -> Document:
    return {
        "number": pose.number,
        "rest": pose.rest,
        "side_down": pose.side_down,
        "tilt_deg": pose.tilt_deg,
        "settled": pose.placement.settled,
        "probability": pose.placement.probability,
    }


def _by_state(counts: dict[str, int]) -> dict[str, int]:
    from manitwin.engine.ledger.ledger import ITEM_STATES

    return {state: counts.get(state, 0) for state in ITEM_STATES}


def _causes(causes: list[Cause]) -> list[Document]:
    return [asdict(cause) for cause in causes]


def _folder(listing: FolderListing) -> Document:
    return {
        "folder": str(listing.folder),
        "inputs": [str(path) for path in listing.inputs],
        "parts": {str(path): str(whole) for path, whole in listing.parts.items()},
        "left": {str(path): why for path, why in listing.left.items()},
    }
