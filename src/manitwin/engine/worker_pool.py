"""A pool of worker processes that no interrupt leaves half started, half stopped, or with a lock that is held for ever."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterable
from typing import Any

from pebble import ProcessPool

from manitwin.engine.interrupts import deferred_interrupts
from manitwin.engine.worker_processes import WorkerContext, spared_from_interrupts


class WorkerPool:
    """Do calls in worker processes, where a crash or a hang costs one of them.

    ``workers`` processes are started with the first call; each calls ``initializer`` first, and ends after ``max_tasks`` calls
    (0: with the pool). Of pebble's pool and futures nothing is asked but while interrupts are put off.

    Owns: the processes.
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
        """Have a function called and return a future of what it returns; ``on_end`` is called with that as it ends.

        Raises RuntimeError where all processes have died before.
        """
        with deferred_interrupts():
            with spared_from_interrupts():
                future = self._processes.schedule(function, args=args, timeout=timeout_s)
            future.add_done_callback(on_end)
            return future

    def result(self, future: Any) -> Any:
        """Wait for a call to end and return what it returned; raises what it raised, and pebble's and its pool's own errors."""
        ended: queue.SimpleQueue[Any] = queue.SimpleQueue()  # written in C: an interrupt leaves none of its locks held
        with deferred_interrupts():
            future.add_done_callback(ended.put)
        ended.get()
        with deferred_interrupts():
            return future.result()

    def refuse(self) -> None:
        """Begin no call any more, nor a process."""
        with deferred_interrupts():
            self._processes.stop()

    def stop(self) -> None:
        """End all processes at once, also one that is stopped (SIGSTOP) or in native code."""
        with deferred_interrupts():
            self._processes.stop()
            self._context.kill()
            self._processes.join()
