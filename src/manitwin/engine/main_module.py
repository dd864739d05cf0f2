"""Spawned workers: the script that started them, and the locks that they share."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.context import SpawnContext
from multiprocessing.synchronize import RLock
from typing import Any


class WorkerContext(SpawnContext):
    """Spawn the workers of one pool, whose locks last as long as this context.

    pebble takes its locks away before it ends its last workers (``WorkerChannel.close``): one that is starting at that
    moment does not find them, and says so with a traceback.
    """

    def __init__(self) -> None:
        super().__init__()
        self._kept: list[RLock] = []

    def RLock(self) -> RLock:
        """Return a lock that is there until this context is gone."""
        lock = super().RLock()
        self._kept.append(lock)
        return lock


@contextmanager
def hidden_main_module() -> Iterator[None]:
    """Keep spawned workers from importing the script that started them: without a guard it would start them again."""
    main = sys.modules["__main__"].__dict__
    hidden: dict[str, Any] = {name: main[name] for name in ("__file__", "__spec__") if name in main}
    main.pop("__file__", None)
    main["__spec__"] = None
    try:
        yield
    finally:
        main.update(hidden)
