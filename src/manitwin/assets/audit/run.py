"""Audit of many assets in isolated processes; this module opens no assets and imports little."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from manitwin.assets.audit.finding import Audited, Finding, RuleText
from manitwin.assets.read import find_assets
from manitwin.assets.root import root_of
from manitwin.assets.within_limits import LIMITS, termination_cause
from manitwin.errors import UsageError, unknown_name_message
from manitwin.formats.isolated import ProcessCrashed, call_function, limit_address_space, run_isolated

if TYPE_CHECKING:
    from manitwin.engine.worker_pool import WorkerPool

ENGINES = ("mujoco", "sapien", "pybullet")
TAKEN_BY = ("mujoco", "pybullet", "sapien", "physx", "gazebo")
"""Engines whose interpretation of collision shapes can be audited (``with_engine_shapes``)."""

AHEAD = 4
"""Number of assets queued for every process."""

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
AUDIT = "manitwin.assets.audit.check:audit_by_codes"
SELECT = "manitwin.assets.audit.selection:selected_texts"


def find_all(
    paths: Iterable[Path], fragments: list[Path] | None = None, templates: list[Path] | None = None
) -> list[Path]:
    """Return every asset at or below the paths without duplicates; raises UsageError for a path that does not exist.

    Descriptions without a shape are appended to ``fragments``, and templates with words in place of numbers to ``templates``;
    neither are assets.
    """
    found: dict[Path, None] = {}
    for path in paths:
        if not os.path.exists(path):
            raise UsageError(f"{path}: no such file or folder; check the path")
        found.update(dict.fromkeys(find_assets(path, fragments, templates)))
    return list(found)


def rules_selected(select: Iterable[str] = (), ignore: Iterable[str] = ()) -> tuple[RuleText, ...]:
    """Return the descriptions of the rules that ``selection.select_rules`` returns; raises UsageError like it."""
    with _one_thread_each():  # for the process started here, which also audits
        rules: tuple[RuleText, ...] = run_isolated(SELECT, list(select), list(ignore))
    return rules


def check_engines(engines: Iterable[str]) -> tuple[str, ...]:
    """Return the engines without duplicates; raises UsageError for one that is unknown or not installed."""
    chosen = tuple(dict.fromkeys(engines))
    for engine in chosen:
        if engine not in ENGINES:
            raise UsageError(f"no engine is called {engine!r}; valid are {', '.join(ENGINES)}")
        if find_spec(engine) is None:
            raise UsageError(f"{engine} is not installed; pip install {engine}, or leave it out of --engines")
    return chosen


def check_engine(engine: str | None) -> str | None:
    """Return the engine whose interpretation of collision shapes is audited; raises UsageError for an unknown one."""
    if engine is not None and engine not in TAKEN_BY:
        raise UsageError(unknown_name_message("engine", engine, TAKEN_BY))
    return engine


def audit_all(
    paths: Sequence[Path],
    rules: Sequence[RuleText],
    *,
    jobs: int = 1,
    fix: bool = False,
    named: Sequence[Path] = (),
    engines: Sequence[str] = (),
    engine: str | None = None,
) -> Iterator[Audited]:
    """Audit assets in ``jobs`` processes and yield the results in the order of the paths.

    ``engines`` are those in which each asset is simulated (``check_engines``), ``engine`` the one whose interpretation of
    collision shapes is audited. ``named`` are the folders that the user gave, below which the files that assets name are read
    (``root_of``). An asset that crashes its process, hangs or uses too much memory gets a finding and does not affect others.
    """
    if jobs > 1 and len(paths) > 1:
        with _one_thread_each():
            yield from _in_processes(paths, rules, jobs, fix, named, engines, engine)
        return
    for path in paths:
        with _one_thread_each():  # another process is started after a crash
            audited = _audit_isolated(path, rules, fix, root_of(path, named), engines, engine)
        yield audited


def _audit_isolated(
    path: Path, rules: Sequence[RuleText], fix: bool, root: Path, engines: Sequence[str], engine: str | None
) -> Audited:
    try:
        codes = tuple(rule.code for rule in rules)
        found: Audited = run_isolated(AUDIT, path, codes, fix, root, tuple(engines), engine, limits=LIMITS)
    except (ProcessCrashed, MemoryError) as error:
        return _unreadable_result(path, termination_cause(error), rules)
    return found


def _unreadable_result(path: Path, cause: str, rules: Sequence[RuleText]) -> Audited:
    findings = [
        Finding(rule.code, rule.severity, str(path), f"{path.name}: {cause}", path)
        for rule in rules
        if rule.code == "FIL001"
    ]
    return Audited(str(path), None, tuple(findings))


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Limit linear algebra in new processes to one thread; the libraries read these variables only when loaded."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys((name for name, value in before.items() if value is None), "1"))
    try:
        yield
    finally:
        for name in (name for name, value in before.items() if value is None):
            os.environ.pop(name, None)


def _in_processes(
    paths: Sequence[Path],
    rules: Sequence[RuleText],
    jobs: int,
    fix: bool,
    named: Sequence[Path],
    engines: Sequence[str],
    engine: str | None,
) -> Iterator[Audited]:
    from manitwin.engine.worker_pool import WorkerPool
    from manitwin.engine.worker_processes import hidden_main_module

    with hidden_main_module():
        pool = WorkerPool(min(jobs, len(paths)), initializer=_prepare_worker, initargs=(LIMITS.memory_bytes,))
        try:
            yield from _audit_in_pool(pool, paths, rules, jobs, fix, named, engines, engine)
        finally:
            pool.stop()


def _prepare_worker(memory_bytes: int) -> None:
    """Prepare a process of the pool, so that imports do not count toward the time limit of an asset."""
    import_module(AUDIT.partition(":")[0])
    limit_address_space(memory_bytes)


def _audit_in_pool(
    pool: WorkerPool,
    paths: Sequence[Path],
    rules: Sequence[RuleText],
    jobs: int,
    fix: bool,
    named: Sequence[Path],
    engines: Sequence[str],
    engine: str | None,
) -> Iterator[Audited]:
    codes = tuple(rule.code for rule in rules)
    waiting: deque[tuple[Path, Any]] = deque()
    for path in paths:
        arguments = (path, codes, fix, root_of(path, named), tuple(engines), engine)
        waiting.append((path, pool.schedule(call_function, (AUDIT, arguments), timeout_s=LIMITS.seconds)))
        if len(waiting) >= AHEAD * jobs:
            yield _result(pool, *waiting.popleft(), rules)
    while waiting:
        yield _result(pool, *waiting.popleft(), rules)


def _result(pool: WorkerPool, path: Path, future: Any, rules: Sequence[RuleText]) -> Audited:
    from pebble import ProcessExpired

    try:
        result: Audited = pool.result(future)
        return result
    except (ProcessExpired, TimeoutError, MemoryError) as error:
        return _unreadable_result(path, termination_cause(error), rules)


def audit_assets(
    paths: Iterable[Path | str],
    *,
    select: Iterable[str] = (),
    ignore: Iterable[str] = (),
    jobs: int = 1,
    fix: bool = False,
    engines: Iterable[str] = (),
    engine: str | None = None,
) -> list[Audited]:
    """Audit every asset at or below paths and return the findings of each.

    ``engine`` (mujoco, pybullet, sapien, physx or gazebo) is the one whose interpretation of collision shapes is audited;
    ``engines`` (mujoco, sapien, pybullet) are those in which assets are simulated too. Raises UsageError for a wrong path, code
    or engine.
    """
    run_in = check_engines(engines)
    check_engine(engine)
    rules = rules_selected(select, ignore)
    given = [Path(path) for path in paths]
    return list(audit_all(find_all(given), rules, jobs=jobs, fix=fix, named=given, engines=run_in, engine=engine))
