"""Remember which job was submitted for which request, so that a crash does not pay for it twice."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Protocol

from manitwin.errors import TwinError
from manitwin.twin.dataset_root import DatasetRoot


class JobMemory(Protocol):
    """Job ids by the digest of what was asked."""

    def recall(self, request: str) -> str | None:
        """Return the job that was submitted for a request, None where there is none."""
        ...

    def note(self, request: str, job_id: str) -> None:
        """Keep a job's id; it is there for the next process once this returns."""
        ...

    def forget(self, request: str) -> None:
        """Drop a job that came to nothing."""
        ...


_REMEDY = "find the job id in your account at the service and enter it, or remove the file and pay for the job again"


@dataclass(frozen=True)
class RootJobMemory:
    """One small file a request below ``name`` of a data set's root, local or at a URL."""

    root: DatasetRoot
    name: str

    def recall(self, request: str) -> str | None:
        """Return the job that was submitted for a request, None where there is none."""
        place = self._place(request)
        if not self.root.exists(place):
            return None
        job_id = self.root.read_json(place, TwinError, remedy=_REMEDY).get("job_id")
        if not isinstance(job_id, str):
            raise TwinError(f"{self.root.full(place)}: has no job_id; {_REMEDY}")
        return job_id

    def note(self, request: str, job_id: str) -> None:
        """Keep a job's id; it is there for the next process once this returns."""
        self.root.write_bytes(self._place(request), json.dumps({"job_id": job_id}).encode())

    def forget(self, request: str) -> None:
        """Drop a job that came to nothing."""
        self.root.remove(self._place(request))

    def _place(self, request: str) -> str:
        return f"{self.name}/{request}.json"


class NoMemory:
    """Remembers nothing: for generators whose jobs end with the process."""

    def recall(self, request: str) -> str | None:
        """Return None: no job is remembered."""
        return None

    def note(self, request: str, job_id: str) -> None:
        """Do nothing: no job is remembered."""

    def forget(self, request: str) -> None:
        """Do nothing: there is no job to forget."""
