"""Rules of the audit, and what they find; nothing that measures is imported here."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from manitwin.assets.audit.complaint import Complaint

if TYPE_CHECKING:
    from manitwin.assets.asset import Asset
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
class Audited:
    """The findings of one asset; ``format`` is None where it could not be read. ``fixed`` says what was rewritten."""

    asset: str
    format: str | None
    findings: tuple[Finding, ...]
    fixed: tuple[str, ...] = ()


@dataclass(frozen=True)
class RuleText:
    """What is said of a rule: a stable code (three letters for the subject, three digits) and texts for a person.

    ``why`` is the paragraph of documentation: what goes wrong in use, with the public report it is known from; ``remedy``
    what to do.
    """

    code: str
    name: str
    severity: Severity
    why: str
    remedy: str


@dataclass(frozen=True)
class Rule(RuleText):
    """A rule, and how it is checked.

    ``check`` yields nothing for an asset that is as it should be, and for one that says nothing of the subject.
    ``fix`` rewrites files where that is safe, and returns what it did.
    """

    check: Callable[[MeasuredAsset], Iterator[Complaint]]
    fix: Callable[[Asset], str] | None = None

    @property
    def text(self) -> RuleText:
        """Return what is said of it, which needs nothing that measures."""
        return RuleText(self.code, self.name, self.severity, self.why, self.remedy)
