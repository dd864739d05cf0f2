"""``manitwin plan``: what so many inputs would take, from what a data set's own inputs took."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import choices, options
from manitwin.cli.console import out_console
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    from manitwin.dataset.forecast import Amount, Forecast

_STAGES_SHOWN = 5


def plan(
    dataset: Annotated[
        str, options.existing("A data set with an index.", "DATASET", "the folder or URL of a data set")
    ],
    items: Annotated[int, typer.Option(help="Inputs to build.", callback=choices.count_of("items"))] = 100_000,
    cores: Annotated[int, typer.Option(help="Cores to build on.", callback=choices.count_of("cores", 10**6))] = 64,
    core_hour_usd: Annotated[
        float | None,
        typer.Option(
            help="The price of a core's hour, in dollars.", callback=choices.amount_of("--core-hour-usd", 1e4)
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="The seed of what is drawn.", min=0, max=options.LARGEST_SEED)] = 0,
    json_: Json = False,
) -> None:
    """Say what so many inputs would take, in hours, dollars, disk and memory, from what those of a data set took."""
    from manitwin.dataset.forecast import forecast
    from manitwin.twin.dataset_root import DatasetRoot

    told = forecast(DatasetRoot(dataset), items, cores, core_hour_usd=core_hour_usd, seed=seed)
    if json_:
        print_document(told.document())
        return
    for line in _lines(told):
        out_console.print(line, markup=False, soft_wrap=True)


def _lines(told: Forecast) -> list[str]:
    first = list(told.stages.items())[:_STAGES_SHOWN]
    shares = ", ".join(f"{name} {share:.0%}" for name, share in first)
    lines = [
        f"{told.items:,} inputs on {told.cores:,} cores, told from {told.measured:,} inputs (intervals: 95 %)",
        f"accepted twins: {_range(told.accepted, 1, '')}",
        f"CPU time: {_range(told.cpu_hours, 1, ' core hours')}; of it {shares}",
        f"time: {_range(told.hours, 1, ' h')} with all cores always busy; the slowest input took {told.slowest_cpu_s:,.0f} CPU s",
        f"services: {_range(told.services_usd, 1, ' dollars')}, as recorded",
    ]
    if told.usd is None:
        lines.append("dollars: not known; say the price of a core's hour with --core-hour-usd")
    else:
        lines.append(f"dollars: {_range(told.usd, 1, '')}, services among them")
    disk = [f"twins {_range(told.twins_bytes, 1e9, ' GB')}"]
    if told.work_bytes is not None:
        disk.append(f"results of stages {_range(told.work_bytes, 1e9, ' GB')}, none with run.keep_work = false")
    disk.append(f"index {told.index_bytes / 1e9:,.2g} GB, ledger {told.ledger_bytes / 1e9:,.2g} GB")
    lines.append(f"disk: {'; '.join(disk)}")
    if told.memory_bytes is None:
        lines.append("memory: not known; the data set has no run.memory_gb")
    else:
        lines.append(
            f"memory: {told.memory_bytes / 2**30:,.0f} GiB at most, the limit of all workers; use is not recorded"
        )
    return lines


def _range(amount: Amount, unit: float, words: str) -> str:
    value, low, high = (each / unit for each in (amount.value, amount.low, amount.high))
    digits = 0 if value >= 100 else 1 if value >= 10 else 2
    return f"{value:,.{digits}f}{words} ({low:,.{digits}f} to {high:,.{digits}f})"
