"""Build many items on this machine: one process an item at a time, so that a crash costs one item."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError, TimeoutError
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pebble import ProcessExpired, ProcessPool

from manitwin.config import BuildConfig
from manitwin.engine.charges import counted
from manitwin.engine.events import OnStage, StageEnded, StageStarted, StageState, log_stage
from manitwin.engine.executors.child_processes import die_with, spared_from_interrupts
from manitwin.engine.executors.one_thread import one_thread_each
from manitwin.engine.main_module import WorkerContext, hidden_main_module
from manitwin.errors import Unavailable
from manitwin.pipeline.build_item import ItemResult, build_item
from manitwin.pipeline.identity import twin_id
from manitwin.pipeline.item import Item

POLL_S = 0.2


_events: Any = None
_spent_usd: Any = None


def _start_worker(events: Any, spent_usd: Any, driver: int) -> None:
    global _events, _spent_usd
    _events, _spent_usd = events, spent_usd
    one_thread_each()
    die_with(driver)


def _build_in_worker(item: Item, out: Path, config: BuildConfig) -> ItemResult:
    reserved_usd = 0.0

    def may_spend(usd: float) -> None:
        nonlocal reserved_usd
        most = config.services.max_cost_usd
        with _spent_usd.get_lock():
            if most is not None and usd > 0 and _spent_usd.value + usd > most:
                raise Unavailable(
                    f"it costs about {usd:.4f} USD, and {_spent_usd.value:.4f} of at most {most:g} USD are spent or under"
                    " way; raise max_cost_usd"
                )
            _spent_usd.value += usd
            reserved_usd = usd

    with counted() as bill:
        result = build_item(item, out, config, _events.put, may_spend)
    with _spent_usd.get_lock():
        _spent_usd.value += bill.usd - reserved_usd
    return result


def build_all(
    items: list[Item],
    out: Path,
    config: BuildConfig,
    *,
    jobs: int,
    on_stage: OnStage = lambda event: None,
) -> Iterator[ItemResult]:
    """Build the items in ``jobs`` processes and yield results as they end.

    A worker that crashes or exceeds ``config.item_timeout_s`` leaves its item unfinished. Closing the iterator early stops
    the workers; finished twins and stages stay.
    """
    with hidden_main_module():
        yield from _build_all(items, out, config, jobs, on_stage)


def _build_all(items: list[Item], out: Path, config: BuildConfig, jobs: int, on_stage: OnStage) -> Iterator[ItemResult]:
    context = WorkerContext()
    events = context.Queue()
    done: queue.Queue[ItemResult] = queue.Queue()
    stop = threading.Event()
    listener = threading.Thread(target=_listen, args=(events, on_stage, stop), daemon=True)
    listener.start()
    shared = (events, context.Value("d", 0.0), os.getpid())
    pool = ProcessPool(
        max_workers=max(1, min(jobs, len(items))), context=context, initializer=_start_worker, initargs=shared
    )
    try:
        for item in items:
            with spared_from_interrupts():
                future = pool.schedule(_build_in_worker, args=(item, out, config), timeout=config.item_timeout_s)
            future.add_done_callback(partial(_hand_over, item, config, done, events))
        for _ in items:
            yield done.get()
        pool.close()
    finally:
        pool.stop()
        pool.join()
        stop.set()
        listener.join()
        events.close()


@dataclass(frozen=True)
class _CutOff:
    """A worker can say no more of its item; put behind all that it did say, as it is dead."""

    item: Item
    state: StageState
    cause: str


def _hand_over(item: Item, config: BuildConfig, done: queue.Queue[ItemResult], events: Any, future: Any) -> None:
    result = _result(future, item, config)
    if isinstance(result, _CutOff):
        events.put(result)
        result = ItemResult(item, twin_id(item), "unfinished", result.cause, None)
    done.put(result)


def _result(future: Any, item: Item, config: BuildConfig) -> ItemResult | _CutOff:
    state: StageState = "failed"
    try:
        result: ItemResult = future.result()
        return result
    except ProcessExpired as error:
        cause = f"the worker process died (exit code {error.exitcode}); run again to retry this item"
    except TimeoutError:
        cause = f"took longer than item_timeout_s = {config.item_timeout_s:g} s; raise it in the configuration, or run again"
    except CancelledError:
        state, cause = "waiting", "interrupted; run again to go on"
    except Exception as error:  # what the worker could not turn into a result: kept visible, the other items go on
        cause = f"a defect in manitwin: {type(error).__name__}: {error}"
    return _CutOff(item, state, cause)


def _listen(events: Any, on_stage: OnStage, stop: threading.Event) -> None:
    """Hand on what workers say, until ``stop`` is set and all of it is heard; say for a dead one that its stage has ended."""
    under_way: dict[Item, StageStarted] = {}
    while True:
        stopping = stop.is_set()
        try:
            event = events.get(timeout=POLL_S)
        except queue.Empty:
            if stopping:
                return
            continue
        except (EOFError, OSError):
            return
        if isinstance(event, StageStarted):
            under_way[event.task.payload] = event
        else:
            begun = under_way.pop(event.item if isinstance(event, _CutOff) else event.task.payload, None)
            if isinstance(event, _CutOff):
                if begun is None:
                    continue
                event = StageEnded(begun.task, begun.stage, event.state, detail=event.cause)
        log_stage(event)
        on_stage(event)
