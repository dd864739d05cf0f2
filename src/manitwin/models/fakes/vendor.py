"""Base of the fake vendors: common web service faults, a key, and files behind signed links."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, ClassVar

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.meshes import mesh_file
from manitwin.models.fakes.pictures import picture_png
from manitwin.models.fakes.server import Request, Response

FILES = "/files/"
XML = {"Content-Type": "application/xml"}
HANG_S = 3600.0
RETRY_AFTER_S = 1
REFUSED = ("unauthorized", "out_of_credit", "rate_limited", "server_error")


def with_outages(faults: Faults, refusals: Mapping[str, tuple[int, Any]], answer: Callable[[], Response]) -> Response:
    """Return the answer, or fail according to ``faults``; ``refusals`` has the service's status and body for faults in REFUSED.

    A refused request has no effect. Requests that hang, are cut off or get a malformed answer have been carried out, but the
    client does not learn of it.
    """
    for fault in REFUSED:
        if fault in refusals and faults.strike(fault):
            status, body = refusals[fault]
            return Response(status, body, {"Retry-After": str(RETRY_AFTER_S)} if fault == "rate_limited" else {})
    response = answer()
    if faults.strike("hangs"):
        threading.Event().wait(HANG_S)
    if faults.strike("disconnects"):
        return replace(response, cut_after=1)
    if faults.strike("not_json"):
        return Response(200, b"<html><body>Back soon</body></html>", {"Content-Type": "text/html"})
    if faults.strike("wrong_schema"):
        return Response(200, {"unexpected": ["answer"]})
    return response


class FakeVendor(ABC):
    """Base class of a mesh generation vendor on this machine: an API with a key, and finished files behind links without a key.

    ``refusals`` are the vendor's answers for common web service faults; ``polls`` is the number of status requests until a job is
    done.
    """

    refusals: ClassVar[Mapping[str, tuple[int, Any]]]

    def __init__(self, faults: Faults | None, key: str, polls: int):
        self.faults, self.key, self.polls = faults or Faults(), key, polls
        self._lock = threading.Lock()

    def authorization(self) -> str:
        """Return the authorization header with the key."""
        return f"Bearer {self.key}"

    def answer(self, request: Request, base_url: str) -> Response:
        """Answer a request like the vendor; requests are serialized."""
        if request.path.startswith(FILES):
            return self._file(request)
        if request.headers.get("authorization") != self.authorization():
            return Response(*self.refusals["unauthorized"])
        return with_outages(self.faults, self.refusals, lambda: self._locked(request, base_url))

    @abstractmethod
    def api(self, request: Request, base_url: str) -> Response:
        """Answer an authorized request."""

    @abstractmethod
    def seed_of(self, job: str) -> int | None:
        """Return the seed of a job's mesh; None for an unknown job."""

    def _locked(self, request: Request, base_url: str) -> Response:
        with self._lock:
            return self.api(request, base_url)

    def _file(self, request: Request) -> Response:
        """Serve ``/files/JOB/NAME`` like an object store behind a signed link.

        A request with a key is an error: Amazon S3 answers 400 to a signed link with an Authorization header.
        """
        job, _, name = request.path.removeprefix(FILES).partition("/")
        seed = self.seed_of(job)
        if "authorization" in request.headers:
            return Response(400, b"<Error><Code>InvalidArgument</Code></Error>", XML)
        if seed is None:
            return Response(404, b"<Error><Code>NoSuchKey</Code></Error>", XML)
        if self.faults.strike("expired_link"):
            return Response(403, b"<Error><Code>AccessDenied</Code></Error>", XML)
        if name.endswith(".png"):
            return Response(200, picture_png(seed), {"Content-Type": "image/png"})
        data = mesh_file("usdz" if name.endswith(".usdz") else "glb", self.faults, seed)
        response = Response(200, data, {"Content-Type": "model/gltf-binary"})
        return replace(response, cut_after=len(data) // 2) if self.faults.strike("disconnects") else response
