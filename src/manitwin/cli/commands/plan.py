"""``manitwin plan``: what so many inputs would take, from what a data set's own inputs took."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import out_console
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    from manitwin.dataset.forecast import Amount, Forecast

_STAGES_SHOWN = 5
_Unit = tuple[float, str]
_HOURS: tuple[_Unit, ...] = ((1.0, "h"), (1 / 60, "min"), (1 / 3600, "s"))
_CORE_HOURS: tuple[_Unit, ...] = ((1.0, "core hours"), (1 / 60, "core minutes"))
_BYTES: tuple[_Unit, ...] = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"))


def plan(
    dataset: Annotated[
        str, options.existing_path_argument("A data set with an index.", "DATASET", "the folder or URL of a data set")
    ],
    items: Annotated[
        int, typer.Option(help="Number of inputs to build.", callback=option_values.count_callback("items"))
    ] = 100_000,
    cores: Annotated[
        int,
        typer.Option(help="Number of CPU cores to build on.", callback=option_values.count_callback("cores", 10**6)),
    ] = 64,
    core_hour_usd: Annotated[
        float | None,
        typer.Option(
            help="Price of one core-hour, in USD.", callback=option_values.amount_callback("--core-hour-usd", 1e4)
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Random seed.", min=0, max=options.LARGEST_SEED)] = 0,
    json_: Json = False,
) -> None:
    """Estimate hours, dollars, disk and memory for a number of inputs, from what the inputs of a data set took."""
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
        f"{told.items:,} inputs on {told.cores:,} cores, estimated from {told.measured:,} measured inputs (intervals: 95 %)",
        f"accepted twins: {_range(told.accepted, 1, '')}",
        f"CPU time: {_format_in_unit(told.cpu_hours, _CORE_HOURS)}; of it {shares}",
        f"time: {_format_in_unit(told.hours, _HOURS)} with all cores always busy; the slowest input took"
        f" {told.slowest_cpu_s:,.0f} CPU s",
        f"services: {_range(told.services_usd, 1, ' dollars')}, as recorded",
    ]
    if told.usd is None:
        lines.append("dollars: unknown; give the price of a core-hour with --core-hour-usd")
    else:
        lines.append(f"dollars: {_range(told.usd, 1, '')}, including services")
    disk = [f"twins {_format_in_unit(told.twins_bytes, _BYTES)}"]
    if told.work_bytes is not None:
        disk.append(f"results of stages {_format_in_unit(told.work_bytes, _BYTES)}, none with run.keep_work = false")
    disk.append(f"index {_rounded(told.index_bytes)}, ledger {_rounded(told.ledger_bytes)}")
    lines.append(f"disk: {'; '.join(disk)}")
    if told.memory_bytes is None:
        lines.append("memory: unknown; the data set has no run.memory_gb")
    else:
        lines.append(
            f"memory: {told.memory_bytes / 2**30:,.0f} GiB at most, the limit of all workers; use is not recorded"
        )
    return lines


def _choose_unit(value: float, units: tuple[_Unit, ...]) -> _Unit:
    """Return the first of some units, the largest first, of which a value has one or more; else the last."""
    return next((unit for unit in units if value >= unit[0]), units[-1])


def _format_in_unit(amount: Amount, units: tuple[_Unit, ...]) -> str:
    size, name = _choose_unit(amount.value, units)
    return _range(amount, size, f" {name}")


def _rounded(size_bytes: float) -> str:
    size, name = _choose_unit(size_bytes, _BYTES)
    return f"{size_bytes / size:,.3g} {name}"


def _range(amount: Amount, unit: float, words: str) -> str:
    value, low, high = (each / unit for each in (amount.value, amount.low, amount.high))
    digits = 0 if value >= 100 else 1 if value >= 10 else 2
    return f"{value:,.{digits}f}{words} ({low:,.{digits}f} to {high:,.{digits}f})"
