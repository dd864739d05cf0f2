"""Pools of Ray actors: workers of one kind, started on demand, replaced when they die, and the jobs they run.

Actors are used for all jobs, not Ray tasks, because the location of a task is unknown. On a machine that vanished without
closing its connections a task never ends (measured with Ray 2.60: the node was declared dead after 64 s, the task was still
pending). It is also unknown when a task started and which crashed process ran it. An actor has a known node and process, and
one job per thread.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

from manitwin.engine.executors.ray_worker import read_crash_report
from manitwin.engine.jobs import Failure, Job, Reply
from manitwin.errors import Unavailable

JOBS_A_WORKER = 2000  # per worker, to bound the memory that native code leaks
START_PATIENCE_S = 120.0
FAILED_STARTS = 5  # consecutive; the installation is then at fault, not a node that died meanwhile
CAUSE_CHARACTERS = 300

Death = Literal["node", "worker", "unreachable"]
Ended = list[tuple[int, Reply]]


@dataclass
class Running:
    """A job that runs on a worker; ``since`` is its start in monotonic seconds."""

    ticket: int
    job: Job
    since: float


@dataclass
class Actor:
    """One worker process. ``node`` is empty while it starts; once ``leaves`` is set it gets no more jobs."""

    handle: Any
    node: str = ""
    stack: str = ""
    jobs: dict[Any, Running] = field(default_factory=dict)
    done: int = 0
    leaves: bool = False
    cause: str = ""
    death: Death = "worker"


class RayPool:
    """A pool of workers with ``threads`` threads each, and a backlog of jobs.

    ``start`` makes an actor. ``blame`` turns a job whose worker or node died into a reply, or None if the job is run again.
    """

    def __init__(
        self,
        threads: int,
        start: Callable[[], Any],
        has_lost: Callable[[str], bool],
        blame: Callable[[Running, Actor, int], Reply],
        timeout_s: float,
    ):
        self._threads, self._start, self._has_lost, self._blame = threads, start, has_lost, blame
        self._timeout_s = timeout_s
        self._backlog: deque[tuple[int, Job]] = deque()
        self._actors: list[Actor] = []
        self._of: dict[Any, Actor] = {}
        self._inquests: set[Any] = set()
        self._failed_starts = 0
        self._stalled_since: float | None = None

    @property
    def refs(self) -> list[Any]:
        """The object references to wait for with Ray."""
        return list(self._of)

    def submit(self, ticket: int, job: Job) -> None:
        """Add a job to the backlog."""
        self._backlog.append((ticket, job))

    def dispatch(self, size: int) -> None:
        """Give backlog jobs to free workers; start workers while the backlog exceeds those starting and ``size`` is not
        reached.
        """
        if not self._backlog:
            return
        for actor in self._actors:
            while self._backlog and actor.node and not actor.leaves and len(actor.jobs) < self._threads:
                ticket, job = self._backlog.popleft()
                ref = actor.handle.do.remote(job)
                actor.jobs[ref] = Running(ticket, job, time.monotonic())
                self._of[ref] = actor
        staying = [actor for actor in self._actors if not actor.leaves]
        coming = sum(self._threads for actor in staying if not actor.node)
        workers = len(staying)
        while coming < len(self._backlog) and workers * self._threads < size:
            actor = Actor(self._start())
            self._actors.append(actor)
            self._of[actor.handle.where.remote()] = actor
            coming, workers = coming + self._threads, workers + 1

    def process_ready_ref(self, ref: Any) -> Ended:
        """Process an object reference that is ready; return the jobs that ended with it."""
        import ray

        actor = self._of.pop(ref, None)
        if actor is None:  # of a worker that has died meanwhile
            return []
        if ref in self._inquests:
            self._inquests.discard(ref)
            return self._end_jobs_of_dead_actor(actor, self._cause_of_death(actor, ref))
        try:
            answer = ray.get(ref)
        except ray.exceptions.RayTaskError as error:  # of one job, e.g. an unpicklable reply
            answer = Failure("error", _line(error.cause if error.cause is not None else error))
        except ray.exceptions.RayError as error:
            return self._handle_actor_death(actor, error)
        if ref not in actor.jobs:
            actor.node, actor.stack = answer
            self._failed_starts = 0
            return []
        return self._done(actor, ref, answer)

    def end_overdue_jobs(self) -> Ended:
        """End jobs that exceed the timeout, bury workers on dead nodes, and end the backlog if no worker starts in time."""
        now, ended = time.monotonic(), Ended()
        for actor in list(self._actors):
            if actor.node and self._has_lost(actor.node):
                actor.cause = "its node died"
                self._kill_actor(actor)
                ended += self._end_jobs_of_dead_actor(actor, "node")
                continue
            for ref, running in list(actor.jobs.items()):
                if now - running.since > self._timeout_s:
                    ended.append((running.ticket, self._timeout_failure()))
                    del actor.jobs[ref], self._of[ref]
                    actor.leaves = True  # one of its threads hangs; the jobs of its other threads may finish
            self._stop_if_idle(actor)
        for ref in list(self._inquests):
            if self._has_lost(self._of[ref].node):  # the node can no longer be asked
                self._inquests.discard(ref)
                ended += self._end_jobs_of_dead_actor(self._of.pop(ref), "node")
        return ended + self._stalled(now)

    def close(self) -> None:
        """Kill all workers."""
        for actor in list(self._actors):
            self._kill_actor(actor)
        self._backlog.clear()

    def _done(self, actor: Actor, ref: Any, answer: Reply) -> Ended:
        running = actor.jobs.pop(ref)
        actor.done += 1
        actor.leaves = actor.leaves or actor.done >= JOBS_A_WORKER
        self._stop_if_idle(actor)
        return [(running.ticket, answer)]

    def _stop_if_idle(self, actor: Actor) -> None:
        if actor.leaves and not actor.jobs and actor in self._actors:
            self._kill_actor(actor)

    def _kill_actor(self, actor: Actor) -> None:
        import ray

        ray.kill(actor.handle)
        self._actors.remove(actor)
        self._of = {ref: of for ref, of in self._of.items() if of is not actor}

    def _handle_actor_death(self, actor: Actor, error: Exception) -> Ended:
        """Collect answers that a dead worker still gave, and ask its node for its last words to tell a worker's death from a
        node's.
        """
        import ray

        ended = Ended()
        for ref in list(actor.jobs):
            try:
                ended += self._done(actor, ref, ray.get(ref, timeout=0))
            except ray.exceptions.RayError:  # ``_end_jobs_of_dead_actor`` decides what becomes of it
                continue
        actor.cause = _cause(error)
        actor.death = "unreachable" if isinstance(error, ray.exceptions.ActorUnavailableError) else "worker"
        if actor in self._actors:
            self._kill_actor(actor)
        if not actor.node:
            return ended + self._failed_start(actor)
        on_its_node: Any = ray.util.scheduling_strategies.NodeAffinitySchedulingStrategy(actor.node, soft=False)
        ask = ray.remote(num_cpus=0, max_retries=0, scheduling_strategy=on_its_node)(read_crash_report)
        ref = ask.remote(actor.stack)
        self._of[ref] = actor
        self._inquests.add(ref)
        return ended

    def _failed_start(self, actor: Actor) -> Ended:
        self._failed_starts += 1
        if self._failed_starts >= FAILED_STARTS:
            raise Unavailable(
                f"the cluster's workers cannot be started: {actor.cause}; "
                "the same manitwin and Python must be installed on every node"
            )
        return []

    def _cause_of_death(self, actor: Actor, ref: Any) -> Death:
        import ray

        try:
            words = ray.get(ref)
        except ray.exceptions.RayTaskError as error:
            actor.cause += f"; its stack cannot be read: {_line(error)}"
            return actor.death
        except ray.exceptions.RayError:  # the node does not answer
            return "node"
        if words:
            actor.cause = words
            return "worker"
        return actor.death

    def _end_jobs_of_dead_actor(self, actor: Actor, death: Death) -> Ended:
        actor.death = death
        ended, together = Ended(), len(actor.jobs)
        for running in actor.jobs.values():
            reply = self._blame(running, actor, together)
            if reply is not None:
                ended.append((running.ticket, reply))
        actor.jobs.clear()
        return ended

    def _timeout_failure(self) -> Failure:
        return Failure("timeout", f"took longer than run.stage_timeout_s = {self._timeout_s:g} s")

    def _stalled(self, now: float) -> Ended:
        """End the backlog as unavailable if no worker has started in time, e.g. if no node has a GPU."""
        if not self._backlog or any(actor.node for actor in self._actors):
            self._stalled_since = None
        elif self._stalled_since is None:
            self._stalled_since = now
        elif now - self._stalled_since > START_PATIENCE_S:
            self._stalled_since = None
            why = f"no worker could be started on the Ray cluster in {START_PATIENCE_S:g} s; `ray status` shows what is free"
            ended: Ended = [(ticket, Failure("unavailable", why)) for ticket, _ in self._backlog]
            self._backlog.clear()
            return ended
        return []


def _line(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:CAUSE_CHARACTERS]


def _cause(error: Exception) -> str:
    """Return the line of Ray's report on a dead actor that states the cause."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    why = [line for line in lines if line.startswith(("The actor is dead because", "The actor died because"))]
    raised = [line for line in lines[1:] if "Error: " in line]
    return " ".join((raised[-1:] or why or lines[:1] or [type(error).__name__])[0].split())[:CAUSE_CHARACTERS]
