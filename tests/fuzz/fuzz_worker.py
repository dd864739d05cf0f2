"""The processes that read mutated files: one that has imported all readers, and a child of it for each run of cases.

Whoever starts it writes a job a line, ``{"target", "folder", "cases", "shared", "said", "cpu_s"}``, and reads what
becomes of it: the child's number, each case before and after it is read, so that it is known which case has ended the child, and
how it ended. The child's address space may grow by 1.5 GB over what reading the samples takes, and a case may take
``cpu_s`` of processor time.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
from pathlib import Path
from random import Random
from typing import Any, TextIO

MEMORY_BYTES = 3 << 29
MAX_MESSAGE_CHARACTERS = 4000
SPARSE_BYTES = 6 << 30

Report = dict[str, Any]


def main() -> None:
    """Import every target, then start a child for each job."""
    import fuzz_targets  # noqa: F401

    reports = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # nothing that a library prints may come between
    for line in sys.stdin:
        job = json.loads(line)
        child = os.fork()
        if child == 0:
            os.setsid()
            with open(job["said"], "wb") as said:
                os.dup2(said.fileno(), 1)
                os.dup2(said.fileno(), 2)
            work(job, reports)
            os._exit(0)
        reports.write(json.dumps({"pid": child}) + "\n")
        _, status = os.waitpid(child, 0)
        reports.write(json.dumps({"ended": os.waitstatus_to_exitcode(status)}) + "\n")


def work(job: dict[str, Any], reports: TextIO) -> None:
    """Read the cases of a job."""
    from fuzz_broken_readers import BROKEN
    from fuzz_numbers import OUTSIDE
    from fuzz_target import TARGETS

    faulthandler.enable()  # a crash tells where
    faulthandler.register(signal.SIGPROF, chain=True)  # and so does a case that takes too long
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.environ["HOME"] = os.environ["TMPDIR"] = job["folder"]
    tempfile.tempdir = None
    target = {**TARGETS, **BROKEN}[job["target"]]
    worker = Worker(target, job["cpu_s"], Path(job["folder"]), Path(job["shared"]) if job["shared"] else None)
    (worker.place.parent / OUTSIDE).write_text("nobody may read this")
    watch_opened_files()
    try:
        wrong = worker.warm_up()
    except BaseException:
        wrong = {"kind": "samples", "where": job["target"], "message": traceback.format_exc()}
    if wrong is not None:
        reports.write(json.dumps({"case": -1, "failure": wrong}) + "\n")
        return
    limit_memory()
    for case in job["cases"]:
        reports.write(json.dumps({"case": case}) + "\n")
        reports.write(json.dumps({"case": case, **worker.run(case)}) + "\n")


_opened: list[str] = []


def watch_opened_files() -> None:
    """Note each opening of a file that no reader may open."""
    from fuzz_numbers import FOREIGN, OUTSIDE

    def heard(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(arguments[0], str | bytes):
            path = os.fsdecode(arguments[0])
            if path == FOREIGN or path.endswith("/" + OUTSIDE):
                _opened.append(path)

    sys.addaudithook(heard)


def limit_memory() -> None:
    """Let the address space grow by no more than ``MEMORY_BYTES`` from here on."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    now = pages * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY_BYTES, resource.getrlimit(resource.RLIMIT_AS)[1]))


class Worker:
    """The samples of a target, a place for cases, and the reader."""

    def __init__(self, target: Any, cpu_s: float, folder: Path, shared: Path | None):
        from fuzz_target import Case

        self.target, self.cpu_s, self.case_of = target, cpu_s, Case
        self.samples, self.place = folder / "samples", folder / f"cases-{os.getpid()}" / "case"
        self.contents = self._contents(self.samples)
        for pattern in target.shared if shared is not None else ():
            for path in sorted(shared.glob(pattern)):
                if path.is_file() and path.stat().st_size < 1 << 21:
                    self.contents[f"shared-{path.name}"] = path.read_bytes()
        self.names = [name for name in self.contents if self._mutable(name)]
        assert self.names, f"{target.name}: none of its samples matches {target.files}"
        self._copy()

    def _contents(self, folder: Path) -> dict[str, bytes]:
        found = sorted(path for path in folder.rglob("*") if path.is_file())
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}

    def _mutable(self, name: str) -> bool:
        return name.startswith("shared-") or any(Path(name).match(pattern) for pattern in self.target.files)

    def _copy(self) -> None:
        shutil.rmtree(self.place, ignore_errors=True)
        shutil.copytree(self.samples, self.place)
        for name, content in self.contents.items():
            if name.startswith("shared-"):
                (self.place / name).write_bytes(content)

    def warm_up(self) -> Report | None:
        """Read samples as they are; returns a failure where one fails, or all are refused."""
        reports = {}
        for name in self.names[: 4 if self.target.fresh else 40]:
            reports[name] = self._read(name)
            if self.target.fresh:
                self._copy()
        if any("failure" in report for report in reports.values()) or all(
            r["outcome"] != "read" for r in reports.values()
        ):
            return {"kind": "samples", "where": self.target.name, "message": json.dumps(reports)}
        return None

    def run(self, case: int) -> Report:
        """Mutate a sample by the case's number, read it, and put the sample back."""
        from fuzz_mutations import mutated

        rng = Random(f"{self.target.name}:{case}")
        name = rng.choice(self.names)
        path = self.place / name
        if self.target.links and rng.random() < 0.02:
            self._replace_by_other_kind(path, rng)
        else:
            others = [
                self.contents[other] for other in self.names if other.rpartition(".")[2] == name.rpartition(".")[2]
            ]
            path.write_bytes(mutated(name, self.contents[name], others, rng))
        try:
            return self._read(name)
        finally:
            self._put_back(path, name)

    def _put_back(self, path: Path, name: str) -> None:
        if self.target.fresh:
            self._copy()
            return
        if path.is_symlink() or not path.is_file():
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)
        path.write_bytes(self.contents[name])

    def _replace_by_other_kind(self, path: Path, rng: Random) -> None:
        """Put something else in a file's place: nothing, a folder, a pipe, a link, a device, a sparse file of 6 GB."""
        from fuzz_numbers import OUTSIDE

        path.unlink()
        kind = rng.randrange(8)
        if kind == 0:
            path.mkdir()
        elif kind == 1:
            os.mkfifo(path)
        elif kind == 2:
            path.symlink_to("/dev/zero")
        elif kind == 3:
            path.symlink_to(path)
        elif kind == 4 and not self.target.named:
            path.symlink_to(self.place.parent / OUTSIDE)
        elif kind == 5 and not self.target.named:
            with path.open("wb") as stream:
                stream.truncate(SPARSE_BYTES)
        elif kind == 6:
            path.write_bytes(b"")

    def _read(self, name: str) -> Report:
        _opened.clear()
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            signal.setitimer(signal.ITIMER_PROF, self.cpu_s)
            try:
                report = self._judged(name)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
        if _opened:
            return {
                "outcome": "failed",
                "failure": {"kind": "opened", "where": name, "message": ", ".join(set(_opened))},
            }
        loud = [each for each in told if not issubclass(each.category, DeprecationWarning | ResourceWarning)]
        if loud and "failure" not in report:
            first = loud[0]
            message = f"{first.category.__name__}: {first.message}"
            report["warning"] = {
                "kind": "warning",
                "where": f"{first.filename}:{first.lineno}",
                "message": message[:300],
            }
        return report

    def _judged(self, name: str) -> Report:
        from manitwin.errors import ManiTwinError

        try:
            self.target.read(self.case_of(self.place, self.place / name))
        except ManiTwinError as error:
            message = str(error)
            if "\n" in message or len(message) > MAX_MESSAGE_CHARACTERS:
                return _failed("message", error, f"{len(message)} characters: {message[:300]!r}")
            short = memory_was_short(error)
            return {"outcome": f"{type(error).__name__}{' (memory)' if short else ''}", "message": message[:300]}
        except (Exception, SystemExit) as error:
            return _failed("exception", error, f"{type(error).__name__}: {str(error)[:300]}")
        return {"outcome": "read"}


def memory_was_short(error: BaseException | None) -> bool:
    while error is not None:
        if isinstance(error, MemoryError):
            return True
        error = error.__cause__ or error.__context__
    return False


def _failed(kind: str, error: BaseException, message: str) -> Report:
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "/manitwin/" in frame.filename] or list(frames)
    where = (
        f"{own[-1].filename.partition('/src/')[2] or own[-1].filename}:{own[-1].lineno} {own[-1].name}" if own else "?"
    )
    told = "".join(traceback.format_exception(error))[-4000:]
    return {"outcome": "failed", "failure": {"kind": kind, "where": where, "message": message, "traceback": told}}


if __name__ == "__main__":
    with contextlib.suppress(BrokenPipeError):
        main()
