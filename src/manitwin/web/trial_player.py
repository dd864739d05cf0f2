"""Playback of grasp trials in a separate process, so that a broken twin can crash that process only."""

from __future__ import annotations

import multiprocessing
import threading
from collections import OrderedDict
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from types import TracebackType

from manitwin.errors import ManiTwinError, TwinError, UsageError
from manitwin.formats.printable import printable_line
from manitwin.twin.loaded_twin import Twin
from manitwin.web.trial_document import trial_bytes

MOST_KEPT = 64
"""Number of cached trial documents, about 100 kB each."""
LONGEST_S = 60.0
"""Timeout. A trial takes a few tenths of a second, starting the process a few seconds."""


@dataclass(frozen=True)
class _TrialError:
    """An error of the other process as text, since not every exception can be pickled."""

    why: str
    usage: bool


def _trial_or_error(folder: str, gripper: str, grasp_id: str) -> bytes | _TrialError:
    try:
        return trial_bytes(folder, gripper, grasp_id)
    except ManiTwinError as error:
        return _TrialError(str(error), isinstance(error, UsageError))
    except Exception as error:  # an altered twin: numbers that no engine accepts, joints that the hand lacks
        cause = printable_line(f"{type(error).__name__}: {error}", max_characters=200)
        return _TrialError(f"{folder}: the trial cannot be run ({cause}); build the twin again", usage=False)


class TrialPlayer:
    """Plays one trial at a time. The process starts with the first trial, and ends with ``close`` or the ``with`` block."""

    def __init__(self) -> None:
        self._pool: ProcessPoolExecutor | None = None
        self._lock = threading.Lock()
        self._closed = False
        self._kept: OrderedDict[tuple[str, str, str, str], bytes] = OrderedDict()

    def play(self, twin: Twin, gripper: str, grasp_id: str) -> bytes:
        """Return the document of a trial as JSON.

        Raises UsageError for a grasp that is unknown or cannot be repeated, and TwinError if the process crashes or times out.
        """
        key = (twin.record.twin_id, twin.record.revision, gripper, grasp_id)
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
            if self._closed:
                raise TwinError("the server ends")
            if self._pool is None:
                self._pool = ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"))
            try:
                answer = self._pool.submit(_trial_or_error, str(twin.folder), gripper, grasp_id).result(LONGEST_S)
            except BrokenProcessPool as error:
                self._end()
                raise TwinError("the trial ended its process; all else of the twin is here") from error
            except TimeoutError as error:
                self._end()
                raise TwinError(f"the trial took more than {LONGEST_S:.0f} s and was ended") from error
            if isinstance(answer, _TrialError):
                raise UsageError(answer.why) if answer.usage else TwinError(answer.why)
            self._kept[key] = document = answer
            while len(self._kept) > MOST_KEPT:
                self._kept.popitem(last=False)
            return document

    def close(self) -> None:
        """Kill the process and any running trial."""
        self._closed = True
        self._end()

    def _end(self) -> None:
        pool, self._pool = self._pool, None
        if pool is None:
            return
        running = list((pool._processes or {}).values())  # a hanging process must not block the shutdown
        pool.shutdown(wait=False, cancel_futures=True)
        for process in running:
            process.kill()

    def __enter__(self) -> TrialPlayer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
