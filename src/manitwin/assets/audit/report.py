"""Audit reports: text for users, JSON for programs, and SARIF for tools that read it."""

from __future__ import annotations

import json
import math
import os
import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

from manitwin.assets.audit.finding import Audited, Finding, Rule, RuleText
from manitwin.formats.installation import installed_version
from manitwin.formats.markdown import one_line
from manitwin.formats.printable import printable_line

PAGE = "docs/audit.md"
SARIF_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"


def count_by_severity(audited: Sequence[Audited]) -> dict[str, int]:
    """Return the numbers of errors, warnings and notes."""
    counts = Counter(finding.severity for each in audited for finding in each.findings)
    return {"error": counts["error"], "warning": counts["warning"], "note": counts["note"]}


MANY = 20
"""Number of assets from which on a digest is added."""
_SEVERITIES, _NOT_READ = ("error", "warning", "note"), ("FIL001", "FIL005", "FIL006")
_LISTED, _CAUSE_CHARACTERS = 10, 100
SAID_ONCE = ("LIC001", "LIC002", "FRI001")
"""Rules that most assets of a set violate alike: for several assets they are reported once, with their count."""


def text_of(each: Audited, *, leave: Collection[str] = ()) -> str:
    """Return the lines of one asset without the rules in ``leave``; empty if nothing else was found or fixed."""
    each = replace(each, findings=tuple(finding for finding in each.findings if finding.code not in leave))
    if not each.findings and not each.fixed:
        return ""
    lines = [f"{printable_line(each.asset)}{f' ({each.format})' if each.format else ''}"]
    lines += [f"  fixed           {printable_line(said)}" for said in each.fixed]
    lines += [f"  {finding.code} {finding.severity:<8} {one_line(finding.message)}" for finding in each.findings]
    return "\n".join(lines)


def shared_text(audited: Sequence[Audited], codes: Collection[str] = SAID_ONCE) -> str:
    """Return one line for each of these rules: its count, the first asset concerned, and the message."""
    lines = []
    for code in codes:
        found = [finding for each in audited for finding in each.findings if finding.code == code]
        if found:
            first = one_line(found[0].message)
            count = len({finding.asset for finding in found})
            which = "" if count == len(audited) else f", as {printable_line(found[0].asset)}"
            lines.append(f"{code} {found[0].severity:<8} {count} of {len(audited)} assets{which}: {first}")
    return "\n".join(lines)


def digest(audited: Sequence[Audited], rules: Sequence[RuleText]) -> str:
    """Return a digest of many assets: counts by rule, causes of unreadable assets, and the assets with most errors."""
    by_rule = Counter(code for each in audited for code in {finding.code for finding in each.findings})
    lines = ["assets by rule"]
    for rule in sorted(rules, key=lambda rule: (_SEVERITIES.index(rule.severity), -by_rule[rule.code], rule.code)):
        if by_rule[rule.code]:
            lines.append(f"  {by_rule[rule.code]:>6} {rule.severity:<8} {rule.code} {rule.name}")
    unread = unreadable_by_cause(audited)
    if unread:
        lines.append("not read or without geometry, by cause")
        for cause, assets in unread[:_LISTED]:
            lines.append(f"  {len(assets):>6} {cause}, as {printable_line(assets[0])}")
    worst = worst_assets(audited)[:_LISTED]
    if worst:
        lines.append("most errors")
        for each in worst:
            counts = count_by_severity([each])
            lines.append(f"  {counts['error']:>6} and {counts['warning']} warnings: {printable_line(each.asset)}")
    return "\n".join(lines)


def unreadable_by_cause(audited: Sequence[Audited]) -> list[tuple[str, list[str]]]:
    """Return the causes of unreadable or unmeasurable assets with the assets concerned, most frequent first."""
    unread: dict[str, list[str]] = {}
    for each in audited:
        for finding in each.findings:
            if finding.code in _NOT_READ:
                unread.setdefault(_cause(finding.message), []).append(each.asset)
    return sorted(unread.items(), key=lambda entry: (-len(entry[1]), entry[0]))


def worst_assets(audited: Sequence[Audited]) -> list[Audited]:
    """Return the assets with errors, sorted by number of errors, then of warnings, then by name."""
    counts = {id(each): count_by_severity([each]) for each in audited}
    found = [each for each in audited if counts[id(each)]["error"]]
    return sorted(found, key=lambda each: (-counts[id(each)]["error"], -counts[id(each)]["warning"], each.asset))


def _cause(message: str) -> str:
    """Return a message without the names and numbers that are specific to an asset."""
    said = one_line(message).partition(": ")[2] or one_line(message)
    said = re.sub(r"'[^']*'|\"[^\"]*\"", "...", said.partition(";")[0])
    said = re.sub(r"\d+(\.\d+)?", "N", said)
    return said if len(said) <= _CAUSE_CHARACTERS else said[: _CAUSE_CHARACTERS - 3] + "..."


def summary(audited: Sequence[Audited]) -> str:
    """Return the last line of a report."""
    counts = count_by_severity(audited)
    clean = sum(not each.findings for each in audited)
    said = ", ".join(f"{count} {name}{'' if count == 1 else 's'}" for name, count in counts.items())
    return f"{len(audited)} assets, {clean} without findings: {said}"


def explanation(rule: Rule) -> str:
    """Return the full description of a rule for users."""
    fixable = "\nmanitwin audit --fix does it where that is safe." if rule.fix is not None else ""
    return f"{rule.code} {rule.name} ({rule.severity})\n\n{rule.why}\n\n{rule.remedy}{fixable}"


def json_of(audited: Sequence[Audited]) -> str:
    """Return all findings as JSON, in their order."""
    content = {
        "manitwin_version": installed_version(),
        "summary": {"assets": len(audited), **count_by_severity(audited)},
        "assets": [
            {
                "asset": each.asset,
                "format": each.format,
                "fixed": list(each.fixed),
                "findings": [_finding_json(finding) for finding in each.findings],
            }
            for each in audited
        ],
    }
    return json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _finding_json(finding: Finding) -> dict[str, Any]:
    return {
        "code": finding.code,
        "severity": finding.severity,
        "message": one_line(finding.message),
        "file": None if finding.file is None else str(finding.file),
        "values": _plain(finding.values),
    }


def sarif_of(audited: Sequence[Audited], rules: Sequence[RuleText]) -> str:
    """Return all findings as a SARIF log, with the help text of every applied rule.

    Source: OASIS, Static Analysis Results Interchange Format 2.1.0, sections 3.13 (log), 3.19 (driver), 3.27 (result), 3.49
    (rules).
    """
    index = {rule.code: number for number, rule in enumerate(rules)}
    log = {
        "$schema": SARIF_SCHEMA,
        "version": "2.1.0",
        "runs": [
            {
                "tool": {
                    "driver": {
                        "name": "manitwin audit",
                        "version": installed_version(),
                        "rules": [_rule_sarif(rule) for rule in rules],
                    }
                },
                "columnKind": "unicodeCodePoints",
                "results": [
                    _result_sarif(finding, index[finding.code]) for each in audited for finding in each.findings
                ],
            }
        ],
    }
    return json.dumps(log, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _rule_sarif(rule: RuleText) -> dict[str, Any]:
    return {
        "id": rule.code,
        "name": "".join(word.capitalize() for word in rule.name.split("-")),
        "shortDescription": {"text": rule.name.replace("-", " ")},
        "fullDescription": {"text": rule.why},
        "help": {"text": f"{rule.remedy} See {PAGE}#{rule.code.lower()}."},
        "defaultConfiguration": {"level": rule.severity},
    }


def _result_sarif(finding: Finding, rule_index: int) -> dict[str, Any]:
    place = {"artifactLocation": {"uri": _uri(finding.file or Path(finding.asset))}}
    return {
        "ruleId": finding.code,
        "ruleIndex": rule_index,
        "level": finding.severity,
        "message": {"text": one_line(finding.message)},
        "locations": [{"physicalLocation": place, "logicalLocations": [{"fullyQualifiedName": finding.asset}]}],
        "properties": {"values": _plain(finding.values)},
    }


def _uri(path: Path) -> str:
    """Return a path as a URI: relative as given, or absolute with its scheme."""
    return path.as_uri() if path.is_absolute() else quote(os.fsencode(path))


def _plain(value: Any) -> Any:
    """Convert values to JSON: numbers that are not finite become strings."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(value)
    return value
