"""The faults that any web service can have, in the words of the service that has them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.server import Response

HANG_S = 3600.0
RETRY_AFTER_S = 1
REFUSED = ("unauthorized", "out_of_credit", "rate_limited", "server_error")


def with_outages(faults: Faults, refusals: Mapping[str, tuple[int, Any]], answer: Callable[[], Response]) -> Response:
    """Answer, or fail as ``faults`` say; ``refusals`` are the status and body of each of REFUSED that the service has.

    A refused request does nothing. A hanging one, one that is cut and one whose answer makes no sense have been carried
    out: whoever asked does not learn of it.
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
