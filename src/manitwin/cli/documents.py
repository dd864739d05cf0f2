"""``--json``: one document of plain values on stdout, and nothing else; docs/json.md names the keys."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli.console import out_console, write_json

if TYPE_CHECKING:
    from manitwin.api import EpisodesReport, TasksReport
    from manitwin.cli.build_plan import Plan
    from manitwin.cli.causes import Cause
    from manitwin.dataset.evaluation.annotations import AnnotationReport
    from manitwin.engine.drive import RunReport
    from manitwin.engine.ledger.progress import ItemStory, Progress
    from manitwin.pipeline.build_report import BuildReport, ItemResult
    from manitwin.pipeline.folder_listing import FolderListing
    from manitwin.scenes.layouts.layouts_run import LayoutTotals
    from manitwin.twin.loaded_twin import Twin
    from manitwin.twin.resting import RestingPose

Document = dict[str, Any]
FLAG = "--json"


# the base of what typer raises for a wrong command line; it has no public name of its own
CommandLineError: type[Exception] = next(
    base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException"
)

_wanted = False


def _set_json_output(wanted: bool) -> bool:
    """Send what is printed for a person to stderr, or no more."""
    global _wanted
    _wanted = out_console.stderr = wanted
    return wanted


Json = Annotated[
    bool,
    typer.Option(
        FLAG, callback=_set_json_output, help="Print one JSON document on stdout; messages for people go to stderr."
    ),
]


def reset_json_output() -> None:
    """Print for a person until ``--json`` is read: an earlier command of this process may have been asked for JSON."""
    _set_json_output(False)


def print_document(document: Document) -> None:
    """Print the document of a command."""
    write_json(json.dumps(document, indent=1, allow_nan=False) + "\n")


def print_failure(error: BaseException, message: str, exit_status: int) -> None:
    """Print the document of a command that could not be carried out."""
    print_document({"error": {"type": type(error).__name__, "message": message, "exit_status": exit_status}})


def is_json_requested(error: BaseException) -> bool:
    """Return whether a command that ended with ``error`` was asked for JSON."""
    return _wanted or (
        isinstance(error, CommandLineError) and _has_json_flag(sys.argv[1:], getattr(error, "ctx", None))
    )


def _has_json_flag(arguments: list[str], context: typer.Context | None) -> bool:
    """Return whether the flag stands in a wrong command line, of which nothing may have been parsed: not as a value."""
    parameters = [] if context is None else [*context.command.params, *context.find_root().command.params]
    take_value = {
        name
        for each in parameters
        for name in each.opts
        if each.param_type_name == "option" and not each.is_flag  # type: ignore[attr-defined]
    }
    left = iter(arguments)
    for argument in left:
        if argument in (FLAG, "--"):
            return argument == FLAG
        if argument in take_value:
            next(left, None)
    return False


def build_document(report: BuildReport, causes: list[Cause]) -> Document:
    """Return what became of every input of a build."""
    from manitwin.cli.run_summary import summarize_grasps

    return {
        **run_document(report.run, report.dataset, causes),
        "counts": {
            **_by_state(report.run.counts_of_given),
            "unfinished": report.count("unfinished"),
        },
        "items": [_item(result) for result in report.iterate()],
        "grasps": asdict(summarize_grasps(report.records())),
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
        "folders": [],
        "exit_status": report.exit_code,
    }


def layouts_document(report: RunReport, place: str, causes: list[Cause], totals: LayoutTotals) -> Document:
    """Return what became of layouts, over all that are there."""
    return {
        **run_document(report, place, causes),
        **asdict(totals),
        "acceptance": totals.acceptance,
    }


def trajectories_document(report: EpisodesReport, place: str, causes: list[Cause]) -> Document:
    """Return what became of batches, attempts and grasps; there are no totals where a batch is missing."""
    return {
        **run_document(report.run, place, causes),
        "attempts": None if report.totals is None else asdict(report.totals),
        "failing_grasps": [{**asdict(each), "failed": each.failed} for each in report.retired],
        "retired_now": report.newly_retired,
    }


def tasks_document(report: TasksReport, place: str, causes: list[Cause]) -> Document:
    """Return how many tasks there are of which kind, and what became of the candidates; no totals where a scene is missing."""
    return {
        **run_document(report.run, place, causes),
        "tasks": None if report.totals is None else asdict(report.totals),
        "bddl": None if report.bddl is None else {"written": report.bddl[0], "left_out": report.bddl[1]},
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
    from manitwin.cli.build_plan import PLANNED_STATES

    return {
        "out": place,
        "items": [
            {
                "file": planned.item.file, "views": list(planned.item.views), "poses": planned.item.poses,
                "text": planned.item.text,
                "name": planned.item.name, "kind": planned.kind,
                "units": planned.item.units, "up": planned.item.up,
                "longest_side_m": planned.item.longest_side_m, "masks": list(planned.item.masks),
                "box_px": list(planned.item.box_px) or None, "twin_id": planned.twin_id, "state": planned.state,
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
        "views": list(item.views),
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
    from manitwin.engine.ledger.rows import ITEM_STATES

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


def annotations_document(report: AnnotationReport) -> Document:
    """Return the scores of annotations: shares by dimension with their intervals, and every question."""
    from manitwin.twin.proportions import wilson_interval

    return {
        "twins": report.twins,
        "shares": {
            name: {"right": right, "asked": asked, "interval": list(wilson_interval(right, asked))}
            for name, (right, asked) in report.shares().items()
        },
        "scores": [asdict(score) for score in report.scores],
        "distances": [asdict(distance) for distance in report.distances],
        "without_twin": list(report.without_twin),
    }
