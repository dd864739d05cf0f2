"""The driver of a run: admit items, submit the next stage of each to a free slot of its resource, and update the ledger.

The driver runs in one thread and is the only writer of the ledger. An item that waits for a service holds no slot, and items
that are nearly finished go first, so that few are in progress. A crash loses at most the running stages: completed results are
found again by their keys.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from typing import get_args

from manitwin.config import Resource, RunConfig
from manitwin.engine.charges import Budget
from manitwin.engine.events import Announcer, ItemEnded, OnStage
from manitwin.engine.flight import Flight, PlannedStage
from manitwin.engine.gate import Gate
from manitwin.engine.jobs import MAKE_ROOM, Executor, Failure, Job, Reply, StageRejected, SurveyReply, WriteTables
from manitwin.engine.ledger.ledger import Ledger, LedgerFull
from manitwin.engine.recipe import Ending, Recipe
from manitwin.engine.stage import ASSEMBLE, INPUT
from manitwin.engine.stage_runner import StageRun
from manitwin.engine.table_writer import TableWriter
from manitwin.engine.task import Task

RUN = logging.getLogger("manitwin.run")
RESOURCES: tuple[Resource, ...] = get_args(Resource)
LONGEST_WAIT_S = 0.5
FAILED_AS = {"died": "crashed", "timeout": "timeout"}


@dataclass
class RunResult:
    """The end of a run: ``stopped`` is the reason if it stopped early, ``left`` counts the items that wait for a service."""

    stopped: str | None = None
    left: int = 0


class Driver:
    """One run over a ledger's open items.

    ``sweep`` deletes partial results of an item that is given up, ``remove`` the finished folder of an item id. ``given`` are
    the numbers of the items that are made again if another recipe made them; empty means all.
    """

    def __init__(
        self,
        ledger: Ledger,
        executor: Executor,
        recipe: Recipe,
        settings: RunConfig,
        on_ended: Callable[[ItemEnded], None] = lambda event: None,
        sweep: Callable[[str], None] = lambda item_id: None,
        remove: Callable[[str], None] = lambda item_id: None,
        clock: Callable[[], float] = time.monotonic,
        max_cost_usd: float | None = None,
        on_stage: OnStage = lambda event: None,
        given: Collection[int] = (),
    ):
        self.ledger, self.executor, self.recipe, self.settings = ledger, executor, recipe, settings
        self._announcer, self._sweep, self._remove, self._clock = Announcer(on_stage, on_ended), sweep, remove, clock
        self._gates = {
            needs: Gate(settings.vlm_per_minute if needs == "vlm" else None, settings.patience_s, clock)
            for needs in RESOURCES
        }
        self._queues: dict[Resource, list[tuple[tuple[int, int], Flight]]] = {needs: [] for needs in RESOURCES}
        self._running: dict[int, tuple[Flight | None, Resource]] = {}
        self._outstanding: dict[Resource, int] = dict.fromkeys(RESOURCES, 0)
        self._plans: dict[str, list[PlannedStage]] = {}
        self._flights, self._given = 0, given
        self._last_number, self._tickets = 0, 0
        self._more = True
        self._budget = Budget(max_cost_usd)
        self._no_money: str | None = None
        self._tables = TableWriter(ledger, settings.index_every if recipe.tables is not None else 0, settings.attempts)
        self.result = RunResult()

    def run(self) -> RunResult:
        """Run until every open item has ended or waits for a service that was given up, or until something stops the run."""
        run = self.ledger.begin_run(self.recipe.sha256, self._given, replaces=self.recipe.replaces)
        RUN.info("run %d begins: recipe %s, seed %d", run, self.recipe.sha256[:16], self.recipe.seed)
        how = "interrupted"
        try:
            while self._step():
                pass
            self.result.stopped = self.result.stopped or self._no_money
            how = self.result.stopped or "finished"
            self.ledger.end_run(run, how)
        except LedgerFull as error:
            self.result.stopped = f"{error}; {MAKE_ROOM}"
            self._wait_for_running_jobs()  # the ledger cannot be written any more; the next run finds the results
        except BaseException:
            with suppress(LedgerFull):
                self.ledger.end_run(run, how)
            raise
        return self.result

    def _step(self) -> bool:
        if self.result.stopped is None:
            self._admit()
            self._submit()
        self.ledger.commit()
        if not self._running and (self.result.stopped is not None or not (any(self._queues.values()) or self._more)):
            return self.result.stopped is None and self._submit_table_job(self._tables.final_job())
        ended = [(ticket, reply, *self._running.pop(ticket)) for ticket, reply in self.executor.ended(self._wait_s())]
        parts = self.executor.parts()
        running = {ticket: self._running[ticket][0] for ticket in parts if ticket in self._running}
        self._announcer.stages_advanced(parts, running)
        for ticket, reply, flight, needs in ended:
            self._outstanding[needs] -= 1
            self._budget.end(
                ticket, reply.charged_usd if isinstance(reply, Failure | StageRun | StageRejected) else 0.0
            )
            if flight is None:
                self.result.stopped = self._tables.handle_reply(reply) or self.result.stopped
            else:
                self._handle(flight, needs, reply)
        return True

    def _wait_for_running_jobs(self) -> None:
        """Wait for all running jobs, so that no worker is stopped while it writes a folder."""
        while self._running:
            for ticket, _ in self.executor.ended(LONGEST_WAIT_S):
                self._running.pop(ticket)

    def _wait_s(self) -> float:
        """Return how long to wait for a reply: at most until the next gate opens for queued items."""
        waits = [self._gates[needs].opens_in_s() for needs in RESOURCES if self._queues[needs]]
        return min([LONGEST_WAIT_S, *(wait for wait in waits if wait > 0)])

    def _admit(self) -> None:
        """Admit items while the queue of CPU jobs is short."""
        while self._more and self._flights < self.settings.in_flight:
            missing = 2 * self.executor.slots("cpu") - len(self._queues["cpu"])
            if missing <= 0:
                return
            opened = self.ledger.next_open(self._last_number, missing)
            self._more = len(opened) == missing
            for item in opened:
                self._last_number = item.number
                self._flights += 1
                task = Task(item.number, self.recipe.payload.from_json(item.payload))
                self._queue(Flight(task, item.attempts))

    def _queue(self, flight: Flight) -> None:
        heappush(self._queues[flight.needs], (flight.priority, flight))

    def _submit(self) -> None:
        for needs, queue in self._queues.items():
            gate = self._gates[needs]
            if gate.is_patience_exhausted:
                self._defer_queue(queue)
            slots = self.executor.slots(needs)
            most = 2 * slots if needs == "cpu" else slots  # one job waits per core, so that no core is idle
            while queue and self._outstanding[needs] < most and gate.opens_in_s() <= 0:
                if not self._budget.allows(queue[0][1].expected_usd):
                    self._hold_for_budget(queue)
                    break
                flight = heappop(queue)[1]
                gate.begin()
                self.ledger.stage_started(flight.number, flight.stage, flight.attempt(flight.stage))
                self._announcer.stage_started(flight)
                self._submit_job(flight.job(), flight)
        self._submit_table_job(self._tables.next_job())

    def _hold_for_budget(self, queue: list[tuple[tuple[int, int], Flight]]) -> None:
        """Leave items that exceed the budget once no paid job is running, as running jobs may cost less than expected."""
        if self._budget.has_no_running_jobs:
            self._no_money = self._budget.stop_reason(queue[0][1].expected_usd)
            self._defer_queue(queue)

    def _submit_job(self, job: Job, flight: Flight | None) -> None:
        self._tickets += 1
        self._budget.begin(self._tickets, 0.0 if flight is None else flight.expected_usd)
        self._running[self._tickets] = (flight, job.needs)
        self._outstanding[job.needs] += 1
        self.executor.submit(self._tickets, job)

    def _submit_table_job(self, job: WriteTables | None) -> bool:
        if job is not None:
            self._submit_job(job, None)
        return job is not None

    def _defer_queue(self, queue: list[tuple[tuple[int, int], Flight]]) -> None:
        """Leave the queued items to the next run."""
        self.result.left += len(queue)
        self._flights -= len(queue)
        queue.clear()

    def _handle(self, flight: Flight, needs: Resource, reply: Reply) -> None:
        gate = self._gates[needs]
        if isinstance(reply, Failure):
            self._failed(flight, gate, reply)
            return
        gate.record_answer()
        if isinstance(reply, SurveyReply):
            self._handle_survey(flight, reply)
        elif isinstance(reply, StageRun):
            self._stage_done(flight, flight.stage, reply)
            self._queue(flight)
        elif isinstance(reply, StageRejected):
            cost = reply.cost
            self.ledger.stage_ended(
                flight.number, flight.stage, "rejected", attempts=flight.attempt(flight.stage), ran=True, error=str(reply.answer),
                seconds=cost.seconds, cpu_seconds=cost.cpu_seconds, cost_usd=cost.cost_usd,
            )  # fmt: skip
            self._announcer.stage_ended(flight, flight.stage, "rejected", cost.seconds, str(reply.answer))
            flight.last, flight.rejected = flight.stage, reply
            self._queue(flight)
        elif isinstance(reply, Ending):
            self.ledger.stage_ended(flight.number, ASSEMBLE, "done", attempts=flight.attempt(ASSEMBLE), ran=True)
            self._announcer.stage_ended(flight, ASSEMBLE, "done")
            self._ended(flight, reply)

    def _handle_survey(self, flight: Flight, reply: SurveyReply) -> None:
        answer = None if reply.rejected is None else str(reply.rejected.answer)
        self.ledger.stage_ended(
            flight.number, INPUT, "done" if answer is None else "rejected", attempts=flight.attempt(INPUT), ran=True,
            error=answer,
        )  # fmt: skip
        self._announcer.stage_ended(flight, INPUT, "done" if answer is None else "rejected", detail=answer or "")
        superseded = self.ledger.superseded_rejection(flight.number, reply.item_id)
        if superseded is not None:  # the input has changed: remove the rejected folder of its previous content
            self._remove(superseded)
            self._tables.record_removed(superseded)
        other = self.ledger.identify(flight.number, reply.item_id, reply.kind)
        flight.task = replace(flight.task, item_id=reply.item_id)
        if other is not None:
            self._flights -= 1
            detail = f"the same input as item {other}"
            self._announcer.item_ended(flight, "duplicate", detail)
            return
        flight.kind, flight.rejected = reply.kind, reply.rejected
        if reply.kind not in self._plans:
            self._plans[reply.kind] = [PlannedStage.of(stage) for stage in self.recipe.stages(reply.kind)]
        flight.plan = self._plans[reply.kind]
        for name, ran in reply.done:
            self._stage_done(flight, name, ran)
        if reply.ending is None:
            self._queue(flight)
            return
        self.ledger.stage_ended(flight.number, ASSEMBLE, "done", attempts=1)
        self._ended(flight, reply.ending, found=True)

    def _stage_done(self, flight: Flight, stage: str, ran: StageRun) -> None:
        self.ledger.stage_ended(
            flight.number, stage, "done", attempts=flight.attempt(stage), key=ran.key,
            ran=not ran.reused, seconds=ran.cost.seconds, cpu_seconds=ran.cost.cpu_seconds, cost_usd=ran.cost.cost_usd,
        )  # fmt: skip
        self._announcer.stage_ended(
            flight, stage, "there already" if ran.reused else "done", 0.0 if ran.reused else ran.cost.seconds
        )
        flight.done.append((stage, ran.key))
        flight.last = stage

    def _ended(self, flight: Flight, ending: Ending, found: bool = False) -> None:
        self._flights -= 1
        self._tables.item_ended()
        self.ledger.item_ended(
            flight.number, ending.status, recipe_sha256=self.recipe.sha256, reason=ending.reason, detail=ending.detail,
            revision=ending.revision,
        )  # fmt: skip
        self._announcer.item_ended(flight, ending.status, ending.detail_and_hint, found, ending.reason)

    def _failed(self, flight: Flight, gate: Gate, failure: Failure) -> None:
        """Retry a failed stage later (outages, which do not count as attempts) or soon, or end the item as failed."""
        stage, number, attempts = flight.stage, flight.number, flight.attempt(flight.stage)
        if failure.kind == "changed":  # the next run starts over
            self._flights -= 1
            self.ledger.stage_ended(number, stage, "waiting", attempts=attempts - 1, error=failure.message)
            self._announcer.stage_waits(flight, stage, failure.message, "", None)
            return
        patient = failure.kind in ("unavailable", "rate_limited", "denied", "no_space")
        if patient or (attempts < self.settings.attempts and failure.kind != "unsupported"):
            counted = attempts - 1 if patient else attempts
            flight.attempts[stage] = counted
            self.ledger.stage_ended(number, stage, "waiting", attempts=counted, error=failure.message)
            if failure.kind == "unavailable":
                gate.record_outage()
            elif failure.kind == "rate_limited":
                gate.wait(failure.retry_after_s)
            elif failure.kind == "no_space":
                self.result.stopped = f"{failure.message}; {MAKE_ROOM}"
            elif failure.kind == "denied":
                self.result.stopped = failure.message
            left_s = gate.remaining_patience_s if failure.kind == "unavailable" else None
            self._announcer.stage_waits(flight, stage, failure.message, failure.trace, left_s)
            self._queue(flight)
            return
        self._flights -= 1
        if flight.task.item_id:
            self._sweep(flight.task.item_id)
        self.ledger.stage_ended(number, stage, "failed", attempts=attempts, error=failure.message)
        self._announcer.stage_ended(flight, stage, "failed", 0.0, failure.message, failure.trace)
        detail, reason = f"{stage} failed {attempts} times: {failure.message}", FAILED_AS.get(failure.kind, "error")
        self.ledger.item_ended(number, "failed", recipe_sha256=self.recipe.sha256, reason=reason, detail=detail)
        self._announcer.item_ended(flight, "failed", detail, reason=reason)
