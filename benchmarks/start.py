"""Measure the start-up cost of command lines, with two checkouts of the code in alternation.

    python benchmarks/start.py MESH [--other CHECKOUT] [--rounds 7] [--builds 3]

For ``manitwin --help`` and a wrong option the figure is the CPU seconds of the whole process. For a build of one mesh
(``--quick``, one worker) it is the CPU seconds of the command and its child processes until the first stage begins, and until
that stage has ended. The rounds alternate between the two checkouts, so that other load affects both alike. Minimum and median
are printed.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent
LINES = {"--help": ["--help"], "wrong option": ["build", "--wrong"]}
BEGINS, DONE = re.compile(r"\bmesh of .* begins"), re.compile(r"\bmesh of .* done")
EVERY_S = 0.005
TICKS_PER_S = os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--other", type=Path, help="a checkout to compare with")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--builds", type=int, default=3)
    arguments = parser.parse_args()
    states = {"this": HERE} | ({"other": arguments.other.resolve()} if arguments.other else {})
    for name, line in LINES.items():
        took = {state: [] for state in states}
        for _ in range(arguments.rounds):
            for state, checkout in states.items():
                took[state].append(whole_cpu_s(checkout, line))
        print_row(name, took)
    begun, done = ({state: [] for state in states} for _ in range(2))
    for _ in range(arguments.builds):
        for state, checkout in states.items():
            begins, ends = first_stage_cpu_s(checkout, arguments.mesh)
            begun[state].append(begins)
            done[state].append(ends)
    print_row("first stage begins", begun)
    print_row("first stage is done", done)


def print_row(name: str, took: dict[str, list[float]]) -> None:
    """Print the minimum and the median for each checkout."""
    shown = (f"{state} {min(each):.3f} least {statistics.median(each):.3f} median" for state, each in took.items())
    print(f"{name:20s} CPU-s: {', '.join(shown)}", flush=True)


def command(checkout: Path, line: list[str]) -> tuple[list[str], dict[str, str]]:
    """Return a command line that uses a checkout's code, and its environment."""
    return [sys.executable, "-m", "manitwin", *line], {
        **os.environ,
        "PYTHONPATH": str(checkout / "src"),
        "COLUMNS": "100",
    }


def whole_cpu_s(checkout: Path, line: list[str]) -> float:
    """Return the CPU seconds of a command that prints and ends."""
    words, environment = command(checkout, line)
    process = subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, _, used = os.wait4(process.pid, 0)
    process.returncode = 0
    return used.ru_utime + used.ru_stime


def first_stage_cpu_s(checkout: Path, mesh: Path) -> tuple[float, float]:
    """Return the CPU seconds of a build until its first stage begins, and until it has ended, from the events of its log."""
    found: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        log, out = Path(folder) / "log.txt", Path(folder) / "out"
        line = ["build", str(mesh), "-o", str(out), "--quick", "--jobs", "1", "--log", str(log)]
        words, environment = command(checkout, line)
        process = subprocess.Popen(
            words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        try:
            while len(found) < 2 and process.poll() is None:
                time.sleep(EVERY_S)
                said = log.read_text() if log.exists() else ""
                if (BEGINS, DONE)[len(found)].search(said):
                    found.append(session_cpu_s(process.pid))
        finally:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    if len(found) < 2:
        sys.exit(f"{mesh}: its first stage was not seen to end")
    return found[0], found[1]


def session_cpu_s(session: int) -> float:
    """Return the CPU seconds of all processes of a session, and of the child processes that they have waited for."""
    ticks = 0
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = place.read_text().rpartition(")")[2].split()
        except OSError:  # the process has ended
            continue
        if int(fields[3]) == session:
            ticks += sum(map(int, fields[11:15]))
    return ticks / TICKS_PER_S


if __name__ == "__main__":
    main()
