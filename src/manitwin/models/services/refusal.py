"""A service's refusals as errors of this package, and retries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any, Literal, TypeVar

from manitwin.config import ServicesConfig
from manitwin.errors import AccessDenied, BadReply, ManiTwinError, RateLimited, Rejected, Unavailable

FIRST_WAIT_S = 1.0
LONGEST_RETRY_AFTER_S = 86_400.0  # who asks for more is not waited for by anybody
MOST_RETRY_AFTER_CHARACTERS = 64
_DEEPEST_WORDS = 4

AnswerT = TypeVar("AnswerT")

Kind = Literal["denied", "busy", "down", "gone", "input", "bad"]


class Gone(BadReply):
    """A service no longer has, or does not know, what it is asked for: a job, a file."""


class NotTaken(BadReply):
    """A request that a service does not understand (400, 422); ``words`` are what it says of it, without the key."""

    def __init__(self, message: str, words: str = ""):
        super().__init__(message)
        self.words = words

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        return type(self), (str(self), self.words)


class Unanswered(Unavailable):
    """A request that may have been taken and paid for, whose answer was lost."""


@dataclass(frozen=True)
class Refusal:
    """A vendor's refusal in its own words.

    ``kind``: ``denied`` (key or credit), ``busy`` (come back later), ``down`` (its own fault), ``gone`` (not known or no longer
    there), ``input`` (it will not work on this picture or text), ``bad`` (anything else).
    """

    message: str
    kind: Kind


@dataclass(frozen=True)
class FailedRequest:
    """A request that came to nothing: whether it may be made again, and after how long where the server says so.

    ``error`` is raised where it may not, or no tries are left.
    """

    error: ManiTwinError
    again: bool
    wait_s: float | None = None


def until_answered(
    attempt: Callable[[], AnswerT | FailedRequest], services: ServicesConfig, sleep: Callable[[float], None]
) -> AnswerT:
    """Return the answer of the first attempt that has one; raises the last failure's error.

    There are ``services.retries`` retries, with pauses that double from 1 s or are what the server asks for; a server that
    asks for more than ``services.longest_wait_s`` is not waited for.
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
    """Read a refusal by its HTTP status (RFC 9110, section 15), and its words wherever JSON APIs put them; None for 2xx."""
    if status < 400:
        return None
    return Refusal(words_of(body) or f"HTTP {status}", kind_of_status(status))


def kind_of_status(status: int) -> Kind:
    """Return the kind of refusal that an HTTP status is."""
    if status in (401, 402, 403):
        return "denied"
    if status in (404, 410):
        return "gone"
    if status == 429:
        return "busy"
    return "down" if status >= 500 else "bad"


def words_of(body: Any, deepest: int = _DEEPEST_WORDS) -> str:
    """Return the message of an error body: ``message``, ``error``, ``detail`` or ``text``, nested or not."""
    if isinstance(body, str):
        return body
    if deepest == 0:
        return ""
    if isinstance(body, list):
        return "; ".join(filter(None, (words_of(part, deepest - 1) for part in body[:3])))
    if not isinstance(body, dict):
        return ""
    names = ("error", "message", "msg", "detail", "text", "suggestion")
    found = [words_of(body.get(name), deepest - 1) for name in names]
    return ": ".join(dict.fromkeys(filter(None, found)))


def error_for(name: str, refusal: Refusal, status: int | None, remedy: str, after_s: float | None) -> ManiTwinError:
    """Return the error that a refusal is; ``remedy`` is for a refused key."""
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
        return NotTaken(what, refusal.message)
    return (Gone if refusal.kind == "gone" else BadReply)(what)


def retry_after_s(value: str | None) -> float | None:
    """Read a Retry-After header, seconds or a date (RFC 9110, section 10.2.3); None without one that can be read.

    At most a day: it stands for all that is too long to wait.
    """
    if value is None or len(value) > MOST_RETRY_AFTER_CHARACTERS:
        return None
    value = value.strip()
    if value.isascii() and value.isdecimal():
        return min(float(value), LONGEST_RETRY_AFTER_S)
    try:
        left = (parsedate_to_datetime(value).astimezone(UTC) - datetime.now(UTC)).total_seconds()
    except (ValueError, TypeError, IndexError, OverflowError, OSError):  # dates before or after all calendars
        return None
    return min(max(left, 0.0), LONGEST_RETRY_AFTER_S)
