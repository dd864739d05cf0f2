"""A process pool that is safe against interrupts: no worker is left half started or stopped, and no lock stays held."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterable
from typing import Any

from pebble import ProcessPool

from manitwin.engine.interrupts import deferred_interrupts
from manitwin.engine.worker_processes import WorkerContext, shield_from_interrupts


class WorkerPool:
    """Runs function calls in worker processes; a crash or hang costs one of them.

    ``workers`` processes are started with the first call. Each calls ``initializer`` first, and exits after ``max_tasks`` calls
    (0: never). Pebble's pool and futures are only used while interrupts are deferred. Owns the processes.
    """

    def __init__(
        self,
        workers: int,
        *,
        max_tasks: int = 0,
        initializer: Callable[..., None] | None = None,
        initargs: Iterable[Any] = (),
    ):
        self._context = WorkerContext()
        self._processes = ProcessPool(
            max_workers=workers, max_tasks=max_tasks, context=self._context, initializer=initializer, initargs=initargs
        )

    def schedule(
        self,
        function: Callable[..., Any],
        args: Iterable[Any] = (),
        *,
        timeout_s: float | None = None,
        on_end: Callable[[Any], None] = lambda future: None,
    ) -> Any:
        """Submit a function call and return its future; ``on_end`` is called with the future when it is done.

        Raises RuntimeError if all processes have died before.
        """
        with deferred_interrupts():
            with shield_from_interrupts():
                future = self._processes.schedule(function, args=args, timeout=timeout_s)
            future.add_done_callback(on_end)
            return future

    def result(self, future: Any) -> Any:
        """Wait for a call and return its result; raises its exception, or an error of pebble or its pool."""
        ended: queue.SimpleQueue[Any] = queue.SimpleQueue()  # implemented in C: an interrupt leaves no lock held
        with deferred_interrupts():
            future.add_done_callback(ended.put)
        ended.get()
        with deferred_interrupts():
            return future.result()

    def close_to_new_calls(self) -> None:
        """Accept no further calls and start no further processes."""
        with deferred_interrupts():
            self._processes.stop()

    def stop(self) -> None:
        """Kill all processes immediately, including stopped ones (SIGSTOP) and those in native code."""
        with deferred_interrupts():
            self._processes.stop()
            self._context.kill()
            self._processes.join()
