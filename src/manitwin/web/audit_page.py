"""HTML report of an audit of assets: findings by rule, unreadable assets, and pictures of the worst ones."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from manitwin.assets.audit.finding import Audited, RuleText
from manitwin.assets.audit.report import count_by_severity, summary, unreadable_by_cause, worst_assets
from manitwin.dataset.report_page import Picture, Section, Table, page

MOST_SHOWN = 24
"""Maximum number of assets shown with a picture and all their findings."""

_SEVERITIES = ("error", "warning", "note")
_SHOWN_AS = "Left what is seen, in its plain colours; right what collides, each shape in a colour of its own."


def shown_assets(audited: Sequence[Audited]) -> list[Audited]:
    """Return the assets shown with a picture: the worst ones, at most ``MOST_SHOWN``."""
    return worst_assets(audited)[:MOST_SHOWN]


def audit_page(audited: Sequence[Audited], rules: Sequence[RuleText], pictures: Mapping[str, bytes]) -> bytes:
    """Return the self-contained page; equal findings and pictures give equal bytes.

    ``pictures`` maps assets to PNGs, for those of ``shown_assets`` that can be drawn.
    """
    lead = [
        summary(audited),
        "An error is wrong, and simulation with it too; a warning is not said, or looks wrong and may be meant; a note is worth"
        " knowing. `manitwin audit --explain CODE` says more of a rule.",
    ]
    sections = [Section("By rule", [_by_rule(audited, rules)])]
    unread = unreadable_by_cause(audited)
    if unread:
        rows = [(cause, len(assets), assets[0]) for cause, assets in unread]
        sections.append(Section("Not read, or without geometry", [Table("By cause", ("cause", "assets", "as"), rows)]))
    sections += [_shown(each, pictures.get(each.asset)) for each in shown_assets(audited)]
    sections.append(Section("All assets with findings", [_all(audited)]))
    return page("Audit of assets", lead, sections)


def _by_rule(audited: Sequence[Audited], rules: Sequence[RuleText]) -> Table:
    assets = Counter(code for each in audited for code in {finding.code for finding in each.findings})
    findings = Counter(finding.code for each in audited for finding in each.findings)
    found = [rule for rule in rules if findings[rule.code]]
    found.sort(key=lambda rule: (_SEVERITIES.index(rule.severity), -assets[rule.code], rule.code))
    rows = [
        (f"{rule.code} {rule.name}", rule.severity, assets[rule.code], findings[rule.code], rule.remedy)
        for rule in found
    ]
    return Table("Findings", ("rule", "severity", "assets", "findings", "what to do"), rows)


def _shown(each: Audited, png: bytes | None) -> Section:
    rows = [(finding.code, finding.severity, finding.message) for finding in each.findings]
    parts: list[Picture | Table] = [Table(each.format or "not read", ("rule", "severity", "finding"), rows)]
    if png is not None:
        parts.append(Picture(png, _SHOWN_AS))
    return Section(each.asset, parts)


def _all(audited: Sequence[Audited]) -> Table:
    rows = []
    for each in audited:
        if each.findings:
            counts = count_by_severity([each])
            codes = ", ".join(dict.fromkeys(finding.code for finding in each.findings))
            rows.append((each.asset, each.format, counts["error"], counts["warning"], counts["note"], codes))
    return Table("Assets", ("asset", "format", "errors", "warnings", "notes", "rules"), rows)
