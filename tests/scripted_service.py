"""A service that answers as a test says, and a client of it."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any

import pytest

from manitwin.config import ServicesConfig
from manitwin.errors import ManiTwinError
from manitwin.models.fakes.server import Request, Response
from manitwin.models.services.http import HttpService

KEY = "sk-the-secret-key-of-tests"
OK = Response(200, {"fine": True})


class Script:
    """Answers in order, the last one for ever; a function is called with the request."""

    def __init__(self, *answers: Response | Callable[[Request], Response]):
        self.answers, self.count = answers, 0

    def answer(self, request: Request, base_url: str) -> Response:
        answer = self.answers[min(self.count, len(self.answers) - 1)]
        self.count += 1
        return answer if isinstance(answer, Response) else answer(request)


class Client:
    """A service and the waits that it did not wait."""

    def __init__(self, url: str, **settings: Any):
        self.waits: list[float] = []
        refusal = settings.pop("refusal", None)
        self.service = HttpService(
            "vendor",
            url,
            authorization={"Authorization": f"Bearer {KEY}"},
            services=ServicesConfig(**{"timeout_s": 20, "retries": 2, **settings}),
            key=KEY,
            remedy="set VENDOR_KEY",
            sleep=self.waits.append,
            **({} if refusal is None else {"refusal": refusal}),
        )


def error_of(work: Callable[[], Any]) -> ManiTwinError:
    with pytest.raises(ManiTwinError) as caught:
        work()
    told = "".join(traceback.format_exception(caught.value)) + repr(caught.value)
    assert KEY not in told and "\n" not in str(caught.value)
    return caught.value
