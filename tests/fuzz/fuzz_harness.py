"""Read many mutated files in worker processes; a hang, a crash or an exception of no error class is a failure with its seed."""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import Any

from fuzz_target import TARGETS, Target

HERE = Path(__file__).resolve().parent
CPU_SECONDS = 10.0
WALL_SECONDS = 60.0
"""A case may wait for another process no longer."""
ASLEEP_SECONDS = 10.0
"""Nor may it wait longer where there is no other process to wait for."""
CASES_A_WORKER = 400
"""After as many a new process begins, so that what a library never frees is not counted against a later case."""


@dataclass(frozen=True)
class Failure:
    """A case that did not end as it should; ``where`` is the same for cases of one cause."""

    target: str
    case: int
    kind: str
    where: str
    message: str
    traceback: str = ""

    def __str__(self) -> str:
        return f"{self.target} --seed {self.case}: {self.kind} at {self.where}: {' '.join(self.message.split())[:400]}"


@dataclass
class Run:
    """What became of the cases of a target: how many ended how, and the failures and warnings, one a cause."""

    target: str
    outcomes: Counter[str] = field(default_factory=Counter)
    failures: list[Failure] = field(default_factory=list)
    warnings: list[Failure] = field(default_factory=list)
    messages: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def causes(self) -> list[Failure]:
        """The first failure of each cause."""
        first: dict[tuple[str, str], Failure] = {}
        for failure in self.failures:
            first.setdefault((failure.kind, failure.where), failure)
        return list(first.values())

    def report(self) -> str:
        """Return lines with the command that reads each failing case again."""
        told = [f"{len(self.failures)} of {self.outcomes.total()} cases of {self.target} failed:"]
        for failure in self.causes:
            told += [
                str(failure),
                f"  again: .venv/bin/python tests/fuzz/fuzz_run.py {failure.target} --seed {failure.case}",
            ]
        return "\n".join(told)


def fuzz(target: Target, count: int, *, first: int = 0, shared: Path | None = None, cpu_s: float = CPU_SECONDS) -> Run:
    """Read ``count`` mutated files of a target from case ``first`` on; the same numbers make the same files."""
    return fuzz_cases(target, range(first, first + count), shared=shared, cpu_s=cpu_s)


def fuzz_cases(target: Target, cases: Sequence[int], *, shared: Path | None = None, cpu_s: float = CPU_SECONDS) -> Run:
    """Read the mutated files of the given cases of a target, in their order."""
    run = Run(target.name)
    started = time.monotonic()
    with tempfile.TemporaryDirectory(prefix=f"fuzz-{target.name}-") as temporary:
        folder = Path(temporary)
        (folder / "samples").mkdir()
        target.make(folder / "samples")
        left = list(cases)
        while left:
            some, rest = left[:CASES_A_WORKER], left[CASES_A_WORKER:]
            left = _work(run, target, folder, some, shared, cpu_s) + rest
    run.seconds = time.monotonic() - started
    return run


def _work(run: Run, target: Target, folder: Path, cases: list[int], shared: Path | None, cpu_s: float) -> list[int]:
    """Let one process read cases until it ends or is ended; returns the cases that are left."""
    said = folder / "said"
    job = {"target": target.name, "folder": str(folder), "cases": cases, "said": str(said), "cpu_s": cpu_s}
    under_way, status = _readers().do(
        {**job, "shared": None if shared is None else str(shared)}, partial(_note, run, target)
    )
    for left in folder.glob("cases-*"):
        shutil.rmtree(left)
    if under_way is None and status == 0:
        return []
    tail = said.read_bytes()[-4000:].decode(errors="replace")
    if under_way is None:
        raise AssertionError(f"{target.name}: the process ended with status {status} and no case under way:\n{tail}")
    run.outcomes["failed"] += 1
    run.failures.append(_ended(target, under_way, status, tail))
    return cases[cases.index(under_way) + 1 :]


class Readers:
    """The process that has all readers imported, and starts one to read cases for each job."""

    def __init__(self) -> None:
        environment = {
            **os.environ,
            **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
        }
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  closed with the process
        self._process = subprocess.Popen(
            [sys.executable, str(HERE / "fuzz_worker.py")],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, env=environment, start_new_session=True,
        )  # fmt: skip
        self._rest = b""
        atexit.register(self.close)

    def close(self) -> None:
        """End it."""
        assert self._process.stdin is not None and self._process.stdout is not None
        atexit.unregister(self.close)
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()
        self._said.close()

    def do(self, job: dict[str, Any], note: Callable[[dict[str, Any]], None]) -> tuple[int | None, int]:
        """Do a job and note its reports; returns the case under way as it ended, and how it ended."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(job).encode() + b"\n")
        self._process.stdin.flush()
        under_way, child = None, 0
        while True:
            lines = self._lines(child)
            if lines is None:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(child, signal.SIGKILL)
                continue
            for line in lines:
                report = json.loads(line)
                if "pid" in report:
                    child = report["pid"]
                elif "ended" in report:
                    with contextlib.suppress(ProcessLookupError):
                        os.killpg(child, signal.SIGKILL)  # what it has started
                    return under_way, report["ended"]
                elif len(report) == 1:
                    under_way = report["case"]
                else:
                    under_way = None
                    note(report)

    def _lines(self, child: int) -> list[bytes] | None:
        """Return whole lines of reports; None where none came for too long."""
        assert self._process.stdout is not None
        place = self._process.stdout.fileno()
        ready, _, _ = select.select([place], [], [], ASLEEP_SECONDS)
        if not ready and child and _asleep(child):
            return None
        if not ready:
            ready, _, _ = select.select([place], [], [], (WALL_SECONDS if child else 4 * WALL_SECONDS) - ASLEEP_SECONDS)
        if not ready:
            return None
        data = os.read(place, 1 << 16)
        if not data:
            self._said.seek(0)
            raise AssertionError(
                f"the process of all readers has ended:\n{self._said.read()[-4000:].decode(errors='replace')}"
            )
        *lines, self._rest = (self._rest + data).split(b"\n")
        return lines


@cache
def _readers() -> Readers:
    return Readers()


def _asleep(child: int) -> bool:
    """Say whether all threads of a process wait for something, and it has started no other that it could wait for."""
    try:
        threads = list(Path(f"/proc/{child}/task").iterdir())
        states = [(thread / "stat").read_text().rpartition(")")[2].split()[0] for thread in threads]
        started = any((thread / "children").read_text().strip() for thread in threads)
    except OSError:  # it has just ended
        return False
    return set(states) == {"S"} and not started


def _note(run: Run, target: Target, report: dict[str, Any]) -> None:
    if report["case"] == -1:
        raise AssertionError(f"{target.name}: {report['failure']}")
    run.outcomes[report["outcome"]] += 1
    run.messages.setdefault(report["outcome"], f"{report['case']}: {report.get('message', '')}")
    if "failure" in report:
        run.failures.append(Failure(target.name, report["case"], **report["failure"]))
    if "warning" in report:
        run.warnings.append(Failure(target.name, report["case"], **report["warning"]))


def _ended(target: Target, case: int, status: int, tail: str) -> Failure:
    stack = [line.strip() for line in tail.splitlines() if line.strip().startswith("File ")]
    own = next((line for line in stack if "manitwin" in line), stack[0] if stack else f"status {status}")
    kinds = {-signal.SIGPROF: "too much processor time", -signal.SIGKILL: "no answer"}
    kind = kinds.get(status, f"the process ended with status {status}")
    return Failure(target.name, case, kind, own.partition("/src/")[2] or own, tail[-300:].replace("\n", " | "), tail)


def all_targets() -> dict[str, Target]:
    """Return every target by its name."""
    import fuzz_targets  # noqa: F401

    return TARGETS
