"""Baseline of known findings, so that only new ones fail the checks of a project."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from manitwin.assets.audit.finding import Audited
from manitwin.errors import UsageError
from manitwin.formats.json_file import read_json_object

VERSION = 1
_REMEDY = "write it anew with --write-baseline"


@dataclass(frozen=True)
class Baseline:
    """Known findings: the rule codes of each asset, by its path relative to ``folder``, which holds the baseline."""

    folder: Path
    codes: dict[str, frozenset[str]]

    def without_known(self, each: Audited) -> Audited:
        """Return the findings of an asset without the known ones."""
        known = self.codes.get(_place(each, self.folder), frozenset())
        return replace(each, findings=tuple(finding for finding in each.findings if finding.code not in known))


def read_baseline(file: Path) -> Baseline:
    """Read a baseline; raises UsageError for an invalid one."""
    if not file.exists():
        raise UsageError(f"{file}: no such baseline; {_REMEDY}")
    content = read_json_object(file, UsageError, remedy=_REMEDY)
    assets = content.get("assets")
    if content.get("version") != VERSION or not isinstance(assets, dict):
        raise UsageError(f"{file}: no baseline of version {VERSION}; {_REMEDY}")
    for asset, codes in assets.items():
        if not isinstance(codes, list) or not all(isinstance(code, str) for code in codes):
            raise UsageError(f"{file}: the codes of {asset[:80]!r} are no list of texts; {_REMEDY}")
    return Baseline(file.resolve().parent, {asset: frozenset(codes) for asset, codes in assets.items()})


def baseline_text(audited: Sequence[Audited], file: Path) -> str:
    """Return the baseline of findings as text for ``file``: JSON, sorted by asset."""
    folder = file.resolve().parent
    found = {_place(each, folder): sorted({finding.code for finding in each.findings}) for each in audited}
    assets = {asset: codes for asset, codes in sorted(found.items()) if codes}
    return json.dumps({"version": VERSION, "assets": assets}, indent=1, ensure_ascii=True) + "\n"


def _place(each: Audited, folder: Path) -> str:
    return Path(os.path.relpath(Path(each.asset).resolve(), folder)).as_posix()
