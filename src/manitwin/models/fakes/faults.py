"""Fault injection for the fake services."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping

from manitwin.errors import UsageError, unknown_name_message

FAULTS = {
    "unauthorized": "the key is refused",
    "out_of_credit": "the account is empty",
    "rate_limited": "too many requests; Retry-After says when to come back",
    "server_error": "an internal error",
    "hangs": "no answer before any timeout",
    "disconnects": "the connection is cut in the middle of the answer",
    "job_fails": "the job ends in failure",
    "job_never_ends": "the job stays under way for ever",
    "job_lost": "the service no longer knows the job",
    "truncated_mesh": "half of a mesh file",
    "empty_mesh": "a mesh file of no bytes",
    "expired_link": "the link of a finished file is no longer valid",
    "draco_mesh": "a GLB compressed with Draco, whose data is broken",
    "webp_texture": "a GLB with a WebP texture",
    "two_meshes": "a USDZ with two meshes",
    "z_up_mesh": "a GLB that stands along Z",
    "open_mesh": "a mesh that encloses nothing",
    "not_json": "an answer that is no JSON",
    "wrong_schema": "JSON that does not follow the schema",
    "cut_answer": "an answer cut off at the limit of its length",
    "refusal": "the model refuses to answer",
    "empty_answer": "an answer without content",
    "no_json_schema": "structured output is not supported",
    "implausible": "a mass beyond what any such thing has",
    "no_grasps": "the model proposes nothing",
}
ALWAYS = -1


class Faults:
    """Number of pending occurrences per fault (``ALWAYS``: unlimited). Thread-safe.

    Raises UsageError for an unknown name.
    """

    def __init__(self, times: Mapping[str, int] | None = None):
        for name in times or {}:
            if name not in FAULTS:
                raise UsageError(unknown_name_message("fault", name, FAULTS))
        self._left = dict(times or {})
        self._lock = threading.Lock()

    @classmethod
    def parse(cls, words: Iterable[str]) -> Faults:
        """Parse words of the form ``name`` (always) or ``name=times``."""
        times: dict[str, int] = {}
        for word in words:
            name, _, count = word.partition("=")
            if count and not count.isdigit():
                raise UsageError(f"fault {word!r}: give a name, or name=times")
            times[name] = int(count) if count else ALWAYS
        return cls(times)

    def strike(self, name: str) -> bool:
        """Return whether a fault occurs now, and decrease its count."""
        if name not in FAULTS:
            raise UsageError(unknown_name_message("fault", name, FAULTS))
        with self._lock:
            left = self._left.get(name, 0)
            if left > 0:
                self._left[name] = left - 1
            return left != 0

    def stop(self, name: str) -> None:
        """Disable a fault."""
        with self._lock:
            self._left.pop(name, None)
