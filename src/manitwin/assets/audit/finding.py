"""Audit rules and their findings, without imports of any measuring code."""

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
    """One defect of one asset as a one-line message; ``file`` is its location, ``values`` are measured values."""

    code: str
    severity: Severity
    asset: str
    message: str
    file: Path | None = None
    values: dict[str, Any] | None = None


@dataclass(frozen=True)
class Audited:
    """The findings of one asset; ``format`` is None if it could not be read. ``fixed`` lists what was rewritten."""

    asset: str
    format: str | None
    findings: tuple[Finding, ...]
    fixed: tuple[str, ...] = ()


@dataclass(frozen=True)
class RuleText:
    """Description of a rule: a stable code (three letters for the subject, three digits) and texts for users.

    ``why`` is the paragraph for the documentation: the consequences in use, with the public report that documents them.
    ``remedy`` says what to do.
    """

    code: str
    name: str
    severity: Severity
    why: str
    remedy: str


@dataclass(frozen=True)
class Rule(RuleText):
    """A rule and its check.

    ``check`` yields nothing for an asset without the defect, and for one that states nothing on the subject. ``fix`` rewrites
    files if that is safe, and returns what it did.
    """

    check: Callable[[MeasuredAsset], Iterator[Complaint]]
    fix: Callable[[Asset], str] | None = None

    @property
    def text(self) -> RuleText:
        """Return the description of the rule, which needs no measuring code."""
        return RuleText(self.code, self.name, self.severity, self.why, self.remedy)
