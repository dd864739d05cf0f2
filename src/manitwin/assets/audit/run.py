"""Hold rules against many assets, in processes of their own."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from pebble import ProcessExpired, ProcessPool

from manitwin.assets.asset import Asset
from manitwin.assets.audit.finding import Complaint, Finding, Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules import RULES, RULES_BY_CODE
from manitwin.assets.read import find_assets, read_asset
from manitwin.engine.worker_processes import WorkerContext, hidden_main_module
from manitwin.errors import AssetError, TwinError, UsageError
from manitwin.twin.store import RECORD, read_record

AHEAD = 4
"""Assets handed to every process in advance."""

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")

STOPS = ("FIL005", "FIL006")
"""Where one of these holds there is nothing to measure."""
ALWAYS = frozenset({"FIL001", "FIL005", "FIL006"})
"""What cannot be read or measured was not audited at all: only --ignore leaves that out."""


@dataclass(frozen=True)
class Audited:
    """The findings of one asset; ``format`` is None where it could not be read. ``fixed`` says what was rewritten."""

    asset: str
    format: str | None
    findings: tuple[Finding, ...]
    fixed: tuple[str, ...] = ()


def find_all(paths: Iterable[Path]) -> list[Path]:
    """Return every asset at or below the paths, each once; raises UsageError for a path that is not there."""
    found: dict[Path, None] = {}
    for path in paths:
        if not path.exists():
            raise UsageError(f"{path}: no such file or folder")
        found.update(dict.fromkeys(find_assets(path)))
    return list(found)


def audit_asset(asset: Asset, rules: Sequence[Rule]) -> list[Finding]:
    """Hold rules against an asset, in their order; one whose geometry cannot be measured gets that finding only."""
    measured = MeasuredAsset(asset)
    broken = [code for code in STOPS if measured.complaints(RULES_BY_CODE[code].check)]
    if broken:
        rules = [rule for rule in rules if rule.code in broken]
    return [_finding(rule, asset.path, complaint) for rule in rules for complaint in measured.complaints(rule.check)]


def audit_path(path: Path, rules: Sequence[Rule], fix: bool = False) -> Audited:
    """Read an asset and hold rules against it; with ``fix``, mend what is safe first. Never raises for an asset's sake."""
    try:
        asset = read_asset(path)
        findings = audit_asset(asset, rules)
        done: list[str] = []
        if fix:
            done = _mend(asset, findings)
            if done:
                asset = read_asset(path)
                findings = audit_asset(asset, rules)
    except AssetError as error:
        return _unread(path, str(error), rules)
    except MemoryError:
        return _unread(path, f"{path.name}: needs more memory than there is", rules)
    return Audited(str(path), asset.format, tuple(findings), tuple(done))


def _mend(asset: Asset, findings: Sequence[Finding]) -> list[str]:
    by_code = dict.fromkeys(RULES_BY_CODE[finding.code].fix for finding in findings)
    done = [fix(asset) for fix in by_code if fix is not None]
    return [said for said in done if not said.startswith("not fixed")]


def _unread(path: Path, cause: str, rules: Sequence[Rule]) -> Audited:
    code = "FIL008" if _is_rejected_twin(path) else "FIL001"
    findings = [
        Finding(rule.code, rule.severity, str(path), " ".join(cause.split()), path)
        for rule in rules
        if rule.code == code
    ]
    return Audited(str(path), "twin" if code == "FIL008" else None, tuple(findings))


def _is_rejected_twin(path: Path) -> bool:
    folder = path.parent if path.name == RECORD else path
    try:
        return (folder / RECORD).is_file() and read_record(folder).status == "rejected"
    except TwinError:
        return False


def _finding(rule: Rule, path: Path, complaint: Complaint) -> Finding:
    return Finding(rule.code, rule.severity, str(path), complaint.message, complaint.file, complaint.values)


def audit_all(paths: Sequence[Path], rules: Sequence[Rule], *, jobs: int = 1, fix: bool = False) -> Iterator[Audited]:
    """Audit assets in ``jobs`` processes and yield what was found in the order of the paths.

    A process that an asset brings down costs that asset alone: it is a finding of it. With one job it all happens here.
    """
    if jobs <= 1 or len(paths) <= 1:
        for path in paths:
            yield audit_path(path, rules, fix)
        return
    with hidden_main_module(), _one_thread_each():
        yield from _in_processes(paths, tuple(rule.code for rule in rules), jobs, fix)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Let new processes do linear algebra with one thread, which the libraries only look for as they are loaded."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys((name for name, value in before.items() if value is None), "1"))
    try:
        yield
    finally:
        for name in (name for name, value in before.items() if value is None):
            os.environ.pop(name, None)


def _in_processes(paths: Sequence[Path], codes: tuple[str, ...], jobs: int, fix: bool) -> Iterator[Audited]:
    pool = ProcessPool(max_workers=min(jobs, len(paths)), context=WorkerContext())
    waiting: deque[tuple[Path, Any]] = deque()
    try:
        for path in paths:
            waiting.append((path, pool.schedule(_audit_in_worker, args=(path, codes, fix))))
            if len(waiting) >= AHEAD * jobs:
                yield _result(*waiting.popleft(), codes)
        while waiting:
            yield _result(*waiting.popleft(), codes)
        pool.close()
    finally:
        pool.stop()
        pool.join()


def _audit_in_worker(path: Path, codes: tuple[str, ...], fix: bool) -> Audited:
    return audit_path(path, [RULES_BY_CODE[code] for code in codes], fix)


def _result(path: Path, future: Any, codes: tuple[str, ...]) -> Audited:
    try:
        result: Audited = future.result()
        return result
    except ProcessExpired as error:
        cause = f"{path.name}: reading it brought the process down (exit code {error.exitcode})"
        return _unread(path, cause, [RULES_BY_CODE[code] for code in codes])


def audit_assets(
    paths: Iterable[Path | str],
    *,
    select: Iterable[str] = (),
    ignore: Iterable[str] = (),
    jobs: int = 1,
    fix: bool = False,
) -> list[Audited]:
    """Audit every asset at or below paths and return what was found of each; raises UsageError for a wrong path or code."""
    rules = select_rules(select, ignore)
    return list(audit_all(find_all(Path(path) for path in paths), rules, jobs=jobs, fix=fix))


def select_rules(select: Iterable[str] = (), ignore: Iterable[str] = ()) -> tuple[Rule, ...]:
    """Return the rules that are selected and not ignored; all are selected where nothing is.

    Codes are taken in any case. The longer beginning wins: ``select=["INE001"], ignore=["INE"]`` leaves INE001 in; equally
    long, ``ignore`` does. Raises UsageError for what no code begins with, naming the nearest.
    """
    chosen, dropped = _prefixes(select), _prefixes(ignore)
    return tuple(rule for rule in RULES if _is_selected(rule.code, chosen, dropped))


def rule_of(code: str) -> Rule:
    """Return the rule of a whole code; raises UsageError naming the nearest."""
    for rule in RULES:
        if rule.code == code.strip().upper():
            return rule
    raise UsageError(_unknown(code.strip().upper()))


def _is_selected(code: str, chosen: Sequence[str], dropped: Sequence[str]) -> bool:
    default = 0 if not chosen or code in ALWAYS else -1
    longest_chosen = max((len(prefix) for prefix in chosen if code.startswith(prefix)), default=default)
    longest_dropped = max((len(prefix) for prefix in dropped if code.startswith(prefix)), default=-1)
    return longest_chosen > longest_dropped


def _prefixes(words: Iterable[str]) -> list[str]:
    prefixes = [word.strip().upper() for word in words if word.strip()]
    for prefix in prefixes:
        if not any(rule.code.startswith(prefix) for rule in RULES):
            raise UsageError(_unknown(prefix))
    return prefixes


def _unknown(code: str) -> str:
    codes = [rule.code for rule in RULES]
    families = list(dict.fromkeys(code[:3] for code in codes))
    near = get_close_matches(code, [*codes, *families], n=1, cutoff=0.5)
    hint = f"did you mean {near[0]}? " if near else ""
    return f"no rule's code is or begins with {code!r}; {hint}Valid beginnings: {', '.join(families)}"
