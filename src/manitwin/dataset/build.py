"""Build the twins of a checked request: run the twin recipe over its items and keep the index up to date during the run."""

from __future__ import annotations

from collections.abc import Callable

from manitwin.dataset.index.parts import IndexTables
from manitwin.engine.drive import ExecutorName, drive
from manitwin.engine.events import ItemEnded, OnStage
from manitwin.pipeline.build_report import BuildReport, ItemResult
from manitwin.pipeline.recipe import TwinRecipe, estimate_usd, log_choices
from manitwin.pipeline.settings import BuildRequest


def build_requested(
    request: BuildRequest,
    *,
    executor: ExecutorName = "local",
    address: str | None = None,
    on_estimate: Callable[[dict[str, float]], None] = lambda usd_by_kind: None,
    on_start: Callable[[int, int], None] = lambda items, opened: None,
    on_stage: OnStage = lambda event: None,
    on_result: Callable[[ItemResult], None] = lambda result: None,
) -> BuildReport:
    """Build the twins of a checked request and return the report.

    ``on_estimate`` receives the estimated service cost in US dollars per kind of service, ``on_start`` the number of items and of
    opened ones. ``on_stage`` is called per stage event, ``on_result`` once per item that ends. Raises UsageError, as ``build``
    does, for errors that only reading the inputs can reveal.
    """
    settings, root = request.settings, request.root
    there: dict[int, bool] = {}
    log_choices(settings)

    def started(items: int, opened: int) -> None:
        on_estimate(estimate_usd(settings))
        on_start(items, opened)

    def ended(event: ItemEnded) -> None:
        there[event.task.number] = event.found
        on_result(ItemResult.of(event.row(), root, event.found))

    run = drive(
        TwinRecipe(settings, IndexTables()), request.items, root, settings.run,
        configuration=settings.model_dump(mode="json"), executor=executor, address=address,
        max_cost_usd=settings.services.max_cost_usd, remarks=request.notes.remarks, on_start=started, on_stage=on_stage,
        on_ended=ended,
    )  # fmt: skip
    found = frozenset(number for number, was_there in there.items() if was_there)
    return BuildReport(request.out, run, request.notes.folders, frozenset(there), found)
