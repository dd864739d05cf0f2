"""Translation of a service's refusals into errors of this package, and retries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any, Literal, TypeVar

from manitwin.config import ServicesConfig
from manitwin.errors import AccessDenied, BadReply, ManiTwinError, RateLimited, Rejected, Unavailable

FIRST_WAIT_S = 1.0
LONGEST_RETRY_AFTER_S = 86_400.0  # upper bound of a Retry-After header; nobody waits that long
MOST_RETRY_AFTER_CHARACTERS = 64
_DEEPEST_WORDS = 4

AnswerT = TypeVar("AnswerT")

Kind = Literal["denied", "busy", "down", "gone", "input", "bad"]


class NotFound(BadReply):
    """The service does not know, or no longer has, the requested job or file."""


class RequestRejected(BadReply):
    """The service does not accept the request (400, 422); ``words`` is its message without the key."""

    def __init__(self, message: str, words: str = ""):
        super().__init__(message)
        self.words = words

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        return type(self), (str(self), self.words)


class AnswerLost(Unavailable):
    """A request may have been accepted and paid for, but its answer was lost."""


@dataclass(frozen=True)
class Refusal:
    """A vendor's refusal with its message.

    ``kind``: ``denied`` (key or credit), ``busy`` (retry later), ``down`` (server error), ``gone`` (unknown or no longer
    available), ``input`` (this picture or text is refused), ``bad`` (anything else).
    """

    message: str
    kind: Kind


@dataclass(frozen=True)
class FailedRequest:
    """A failed request: whether it may be repeated, and after how long if the server says so.

    ``error`` is raised if it may not be repeated or no retries are left.
    """

    error: ManiTwinError
    again: bool
    wait_s: float | None = None


def retry_request(
    attempt: Callable[[], AnswerT | FailedRequest], services: ServicesConfig, sleep: Callable[[float], None]
) -> AnswerT:
    """Return the answer of the first successful attempt; raises the error of the last failure.

    There are ``services.retries`` retries, with pauses that double from 1 s or are given by the server; if the server asks
    for more than ``services.longest_wait_s``, the error is raised at once.
    """
    pause = FIRST_WAIT_S
    for left in range(services.retries, -1, -1):
        outcome = attempt()
        if not isinstance(outcome, FailedRequest):
            return outcome
        wait = pause if outcome.wait_s is None else outcome.wait_s
        too_long = outcome.wait_s is not None and wait > services.longest_wait_s
        if not left or not outcome.again or too_long:
            raise outcome.error
        sleep(min(wait, services.longest_wait_s))
        pause *= 2
    raise AssertionError("the last try returns or raises")


def refusal_by_status(status: int, body: Any) -> Refusal | None:
    """Parse a refusal by its HTTP status (RFC 9110, section 15), with the message from the usual fields; None below 400."""
    if status < 400:
        return None
    return Refusal(error_message(body) or f"HTTP {status}", kind_of_status(status))


def kind_of_status(status: int) -> Kind:
    """Return the kind of refusal of an HTTP status."""
    if status in (401, 402, 403):
        return "denied"
    if status in (404, 410):
        return "gone"
    if status == 429:
        return "busy"
    return "down" if status >= 500 else "bad"


def error_message(body: Any, deepest: int = _DEEPEST_WORDS) -> str:
    """Return the message of an error body: the texts of ``error``, ``message``, ``msg``, ``detail``, ``text``, ``suggestion``.

    Nested values are searched to a limited depth.
    """
    if isinstance(body, str):
        return body
    if deepest == 0:
        return ""
    if isinstance(body, list):
        return "; ".join(filter(None, (error_message(part, deepest - 1) for part in body[:3])))
    if not isinstance(body, dict):
        return ""
    names = ("error", "message", "msg", "detail", "text", "suggestion")
    found = [error_message(body.get(name), deepest - 1) for name in names]
    return ": ".join(dict.fromkeys(filter(None, found)))


def error_for(name: str, refusal: Refusal, status: int | None, remedy: str, after_s: float | None) -> ManiTwinError:
    """Return the error for a refusal; ``remedy`` is the advice for a refused key."""
    said = f" (HTTP {status})" if status is not None and refusal.message != f"HTTP {status}" else ""
    what = f"{name}: {refusal.message}{said}"
    if refusal.kind == "denied":
        return AccessDenied(f"{what}; {remedy}")
    if refusal.kind == "busy":
        return RateLimited(f"{what}; run again later", after_s)
    if refusal.kind == "down":
        return Unavailable(f"{what}; run again later")
    if refusal.kind == "input":
        return Rejected("generator_failed", what, "generate")
    if status in (400, 422):
        return RequestRejected(what, refusal.message)
    return (NotFound if refusal.kind == "gone" else BadReply)(what)


def retry_after_s(value: str | None) -> float | None:
    """Parse a Retry-After header, seconds or a date (RFC 9110, section 10.2.3); None if it is missing or unreadable.

    The result is at most one day.
    """
    if value is None or len(value) > MOST_RETRY_AFTER_CHARACTERS:
        return None
    value = value.strip()
    if value.isascii() and value.isdecimal():
        return min(float(value), LONGEST_RETRY_AFTER_S)
    try:
        left = (parsedate_to_datetime(value).astimezone(UTC) - datetime.now(UTC)).total_seconds()
    except (ValueError, TypeError, IndexError, OverflowError, OSError):  # dates outside the range of datetime
        return None
    return min(max(left, 0.0), LONGEST_RETRY_AFTER_S)
