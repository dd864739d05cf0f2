"""Rules of the audit, and what they find."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from manitwin.assets.asset import Asset

if TYPE_CHECKING:
    from manitwin.assets.audit.measured import MeasuredAsset

Severity = Literal["error", "warning", "note"]


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with one asset, in a line for a person; ``file`` is where, ``values`` what was measured."""

    code: str
    severity: Severity
    asset: str
    message: str
    file: Path | None = None
    values: dict[str, Any] | None = None


@dataclass(frozen=True)
class Rule:
    """A rule with a stable code (three letters for the subject, three digits), and how it is checked.

    ``why`` is the paragraph of documentation: what goes wrong in use, with the public report it is known from; ``remedy``
    what to do. ``check`` yields nothing for an asset that is as it should be, and for one that says nothing of the subject.
    ``fix`` rewrites files where that is safe, and returns what it did.
    """

    code: str
    name: str
    severity: Severity
    why: str
    remedy: str
    check: Callable[[MeasuredAsset], Iterator[Complaint]]
    fix: Callable[[Asset], str] | None = None


@dataclass(frozen=True)
class Complaint:
    """The message, where, and the numbers behind it."""

    message: str
    file: Path | None = None
    values: dict[str, Any] | None = None
