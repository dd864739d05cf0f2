"""Findings for a person, for a program, and for whoever reads SARIF."""

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
    """Return how many errors, warnings and notes there are."""
    counts = Counter(finding.severity for each in audited for finding in each.findings)
    return {"error": counts["error"], "warning": counts["warning"], "note": counts["note"]}


MANY = 20
"""From so many assets on what they amount to is said as well."""
_SEVERITIES, _NOT_READ = ("error", "warning", "note"), ("FIL001", "FIL005", "FIL006")
_LISTED, _CAUSE_CHARACTERS = 10, 100
SAID_ONCE = ("LIC001", "LIC002", "FRI001")
"""Rules of which most assets of a set have the same fault: of several assets they are said once with their count."""


def text_of(each: Audited, *, leave: Collection[str] = ()) -> str:
    """Return the lines of one asset without rules to ``leave``, empty where nothing else was found and nothing fixed."""
    each = replace(each, findings=tuple(finding for finding in each.findings if finding.code not in leave))
    if not each.findings and not each.fixed:
        return ""
    lines = [f"{printable_line(each.asset)}{f' ({each.format})' if each.format else ''}"]
    lines += [f"  fixed           {printable_line(said)}" for said in each.fixed]
    lines += [f"  {finding.code} {finding.severity:<8} {one_line(finding.message)}" for finding in each.findings]
    return "\n".join(lines)


def shared_text(audited: Sequence[Audited], codes: Collection[str] = SAID_ONCE) -> str:
    """Return a line for each of these rules: of how many assets it was found, of which first, and what is said of it."""
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
    """Return what many assets amount to, for a person: by rule, what could not be read and why, and the worst assets."""
    by_rule = Counter(code for each in audited for code in {finding.code for finding in each.findings})
    lines = ["assets by rule"]
    for rule in sorted(rules, key=lambda rule: (_SEVERITIES.index(rule.severity), -by_rule[rule.code], rule.code)):
        if by_rule[rule.code]:
            lines.append(f"  {by_rule[rule.code]:>6} {rule.severity:<8} {rule.code} {rule.name}")
    unread = unread_by_cause(audited)
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


def unread_by_cause(audited: Sequence[Audited]) -> list[tuple[str, list[str]]]:
    """Return why assets could not be read or measured, with the assets of each cause, the most frequent first."""
    unread: dict[str, list[str]] = {}
    for each in audited:
        for finding in each.findings:
            if finding.code in _NOT_READ:
                unread.setdefault(_cause(finding.message), []).append(each.asset)
    return sorted(unread.items(), key=lambda entry: (-len(entry[1]), entry[0]))


def worst_assets(audited: Sequence[Audited]) -> list[Audited]:
    """Return the assets with errors, those with most errors first, then with most warnings, then by name."""
    counts = {id(each): count_by_severity([each]) for each in audited}
    found = [each for each in audited if counts[id(each)]["error"]]
    return sorted(found, key=lambda each: (-counts[id(each)]["error"], -counts[id(each)]["warning"], each.asset))


def _cause(message: str) -> str:
    """Return a message without the names and numbers that tell one asset from another."""
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
    """Return all that is known of a rule, for a person."""
    fixable = "\nmanitwin audit --fix does it where that is safe." if rule.fix is not None else ""
    return f"{rule.code} {rule.name} ({rule.severity})\n\n{rule.why}\n\n{rule.remedy}{fixable}"


def json_of(audited: Sequence[Audited]) -> str:
    """Return all findings as JSON, sorted as they were found."""
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
    """Return all findings as a SARIF log, with the help of every rule that was applied.

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
    """Return a path as a URI: relative as it was given, or absolute with its scheme."""
    return path.as_uri() if path.is_absolute() else quote(os.fsencode(path))


def _plain(value: Any) -> Any:
    """Return values that JSON has: numbers that are not finite become words."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(value)
    return value
