"""The error tree: every failure that a user can meet is one of these::

    ManiTwinError
    ├── UsageError            wrong arguments, a path that is not there                      exit 2
    │   └── ConfigError       a configuration that cannot be used
    ├── InputError            an input that cannot be read: ends as a rejected twin          exit 3
    ├── Rejected              an answer, not an accident: kept with its reason               exit 3
    ├── InputChanged          an input that was changed or deleted while it was worked on       exit 4
    ├── TwinError             a finished twin folder that cannot be read or written
    │   └── NewerVersion      one that a newer version of this package has written
    ├── AssetError            an asset of another tool that cannot be read
    ├── ExportError           a twin that cannot be written in a format
    ├── EpisodesError         recorded episodes that cannot be read or written
    └── BackendError          something else failed; the item stays resumable                exit 4
        ├── Unavailable       it does not answer, or is not installed
        ├── Unsupported       it cannot do what is asked, now or later: choose another
        ├── AccessDenied      it refuses the key, or there is no credit: waiting does not help
        ├── RateLimited       it asks to wait
        ├── BadReply          it answered something that cannot be used
        └── RendererMissing   no Vulkan device to render with

A message names the file or the thing, the cause and the remedy, and lists what would be valid.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Any

_SHOWN_CHARACTERS = 100
_MOST_CHARACTERS = 3000
_LAST_CHARACTERS = 500


class ManiTwinError(Exception):
    """Base of every error that this package raises on purpose.

    Its message is text that UTF-8 has: the bytes of a file's name that are none are written out, as ``\\udce9``. Of a text that
    names of a file have made longer than 3,000 characters, the beginning and the end (the remedy) are kept.
    """

    def __init__(self, *args: object):
        super().__init__(*(_shorten_text(encodable(each)) if isinstance(each, str) else each for each in args))


class UsageError(ManiTwinError):
    """A command or call that cannot be carried out as it was given."""


class ConfigError(UsageError):
    """A configuration with an unknown key or a value outside its range."""


class TwinError(ManiTwinError):
    """A finished twin folder that is incomplete, altered or of an unknown schema."""


class NewerVersion(TwinError):
    """A finished folder that a newer version of this package has written: nothing is wrong with it, and it is left as it is."""


class AssetError(ManiTwinError):
    """An asset of another tool that cannot be read, or is none."""


class ExportError(ManiTwinError):
    """A twin that has not what a format needs, or whose licence does not allow it."""


class EpisodesError(ManiTwinError):
    """A file or folder of recorded episodes that is incomplete, altered, or not in the layout it should be in."""


class Rejected(ManiTwinError):
    """The decision not to make a twin of this input.

    ``reason`` is one of ``manitwin.twin.record.REJECTION_REASONS[stage]``; ``detail`` is one line for a person.
    ``stage`` is needed only where two stages share the reason. ``files`` are kept with the rejection, by their names: what a
    person can judge it by.
    """

    def __init__(self, reason: str, detail: str, stage: str | None = None, files: Mapping[str, bytes] | None = None):
        detail = encodable(detail)
        super().__init__(f"{reason}: {detail}")
        self.reason, self.detail, self.stage, self.files = reason, detail, stage, dict(files or {})

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        return type(self), (self.reason, self.detail, self.stage, self.files)


class InputError(Rejected):
    """An input that cannot be read, or is not what it claims to be."""

    def __init__(self, reason: str, detail: str, stage: str | None = "input", files: Mapping[str, bytes] | None = None):
        super().__init__(reason, detail, stage, files)


class InputChanged(ManiTwinError):
    """An input that was changed or deleted while a run was at work on it: the item stays open for the next run."""


class BackendError(ManiTwinError):
    """A model, simulator or service that could not do its work; the item can be resumed."""


class Unavailable(BackendError):
    """A backend that is not installed, not running or does not answer."""


class Unsupported(BackendError):
    """A backend that cannot do what is asked of it, however often; another one could."""


class AccessDenied(BackendError):
    """A service that refuses the key, or has no credit left: a person has to act before it is asked again."""


class RateLimited(BackendError):
    """A backend that asks to be called later, after ``retry_after_s`` where it says so."""

    def __init__(self, message: str, retry_after_s: float | None = None):
        super().__init__(message)
        self.retry_after_s = retry_after_s

    def __reduce__(self) -> tuple[type, tuple[str, float | None]]:
        return type(self), (str(self), self.retry_after_s)


class BadReply(BackendError):
    """A backend whose answer cannot be used."""


class RendererMissing(Unavailable):
    """No Vulkan device that SAPIEN can render with."""


def encodable(text: str) -> str:
    """Return text with lone surrogates written out, which no ledger, table or file of UTF-8 takes."""
    return text.encode("utf-8", errors="backslashreplace").decode("utf-8")


def _shorten_text(text: str) -> str:
    if len(text) <= _MOST_CHARACTERS:
        return text
    first = _MOST_CHARACTERS - _LAST_CHARACTERS
    return f"{text[:first]} ... ({len(text) - _MOST_CHARACTERS} more characters) ... {text[-_LAST_CHARACTERS:]}"


def unknown_name_message(kind: str, name: str, valid: Iterable[str]) -> str:
    """Describe an unknown name, of a long one its begin: the nearest valid one first, then all of them."""
    valid, name = sorted(valid), name if len(name) <= _SHOWN_CHARACTERS else f"{name[:_SHOWN_CHARACTERS]}..."
    near = get_close_matches(name, valid, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else "."
    return f"unknown {kind} {name!r}{hint} Valid: {', '.join(valid)}"
