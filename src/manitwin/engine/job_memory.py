"""Memory of submitted service jobs by request, so that a crash does not pay for a job twice."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Protocol

from manitwin.errors import TwinError
from manitwin.twin.dataset_root import DatasetRoot


class JobMemory(Protocol):
    """Job ids by the digest of the request."""

    def recall(self, request: str) -> str | None:
        """Return the id of the job submitted for a request; None if there is none."""
        ...

    def note(self, request: str, job_id: str) -> None:
        """Store a job's id durably; the next process can read it once this returns."""
        ...

    def forget(self, request: str) -> None:
        """Remove the id of a failed job."""
        ...


_REMEDY = "find the job id in your account at the service and enter it, or remove the file and pay for the job again"


@dataclass(frozen=True)
class RootJobMemory:
    """Job memory as one small file per request below ``name`` in a data set's root, local or at a URL."""

    root: DatasetRoot
    name: str

    def recall(self, request: str) -> str | None:
        """Return the id of the job submitted for a request; None if there is none. Raises TwinError for a damaged file."""
        place = self._place(request)
        if not self.root.exists(place):
            return None
        job_id = self.root.read_json(place, TwinError, remedy=_REMEDY).get("job_id")
        if not isinstance(job_id, str):
            raise TwinError(f"{self.root.full(place)}: has no job_id; {_REMEDY}")
        return job_id

    def note(self, request: str, job_id: str) -> None:
        """Store a job's id durably; the next process can read it once this returns."""
        self.root.write_bytes(self._place(request), json.dumps({"job_id": job_id}).encode())

    def forget(self, request: str) -> None:
        """Remove the id of a failed job."""
        self.root.remove(self._place(request))

    def _place(self, request: str) -> str:
        return f"{self.name}/{request}.json"


class NullJobMemory:
    """Job memory that stores nothing, for generators whose jobs end with the process."""

    def recall(self, request: str) -> str | None:
        """Return None: no job is stored."""
        return None

    def note(self, request: str, job_id: str) -> None:
        """Do nothing."""

    def forget(self, request: str) -> None:
        """Do nothing."""
