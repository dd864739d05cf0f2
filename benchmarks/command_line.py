"""Measure CPU and wall seconds of the command line without arguments, for help, and for wrong arguments.

    python benchmarks/command_line.py [--cold]

``--cold`` measures without compiled bytecode, as for the first command after an installation.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time

import typer

from manitwin.cli.main import app

WRONG_VALUES = (
    "paint",
    "build",
    "build nothing_here.png -o out",
    "build . -o out --units inch",
    "build . -o out --vlm nobody",
    "build -o out --executor cloud",
    "layout . -o out --robot nobody",
    "trajectories . -o out --format csv",
    "render . --cameras behind",
    "export . -o out --to obj",
)


def measured(words: list[str], environment: dict[str, str]) -> tuple[float, float, int]:
    """Return the CPU seconds, wall seconds and exit status of one command."""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run([sys.executable, "-m", "manitwin", *words], capture_output=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu_s, time.perf_counter() - started, done.returncode


def main() -> None:
    """Print a line for each command, and the slowest one last."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cold", action="store_true")
    cold = parser.parse_args().cold
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    lines = ["", "--version", "--wrong", *WRONG_VALUES]
    lines += [f"{name} {option}" for name in commands for option in ("--help", "--wrong")]
    found = []
    for line in lines:
        with tempfile.TemporaryDirectory() as empty:
            environment = {**os.environ, "PYTHONPYCACHEPREFIX": empty} if cold else dict(os.environ)
            found.append((*measured(line.split(), environment), line))
    for cpu_s, wall_s, status, line in sorted(found):
        print(f"{cpu_s:.2f} CPU-s {wall_s:.2f} s  exit {status}  manitwin {line}")


if __name__ == "__main__":
    main()
