"""Finished files behind signed links, as the vendors' object stores serve them."""

from __future__ import annotations

from dataclasses import replace

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.server import Request, Response


def served_file(faults: Faults, request: Request, data: bytes) -> Response:
    """Return the answer to a request for a finished file.

    A key that is sent along is an error: Amazon S3 answers 400 to a signed link with an Authorization header.
    """
    if "authorization" in request.headers:
        return Response(400, b"<Error><Code>InvalidArgument</Code></Error>", {"Content-Type": "application/xml"})
    if faults.strike("expired_link"):
        return Response(403, b"<Error><Code>AccessDenied</Code></Error>", {"Content-Type": "application/xml"})
    response = Response(200, data, {"Content-Type": "model/gltf-binary"})
    return replace(response, cut_after=len(data) // 2) if faults.strike("disconnects") else response
