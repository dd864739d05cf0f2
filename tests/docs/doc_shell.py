"""A shell in a page's folder: each command is a process, what is exported and where one went to stays for the next."""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path

from doc_services import REDIRECTED

ROOT = Path(__file__).resolve().parents[2]
LONGEST_S = 900
KEYS = re.compile(r"\w+_API_KEY|FAL_KEY|MANITWIN_\w+")


class Shell:
    """Runs commands below ``folder``, with caches and a home of its own and no key of whoever runs the tests."""

    def __init__(self, folder: Path, **variables: str):
        self.folder = folder
        kept = {name: value for name, value in os.environ.items() if not KEYS.fullmatch(name)}
        paths = [ROOT / "src"] + ([REDIRECTED] if "DOCS_REDIRECTED" in variables else [])
        self.environment = kept | {
            "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
            "PYTHONPATH": ":".join(map(str, paths)),
            "COLUMNS": "200",
            "PIP_NO_INDEX": "1",
            "PIP_TARGET": str(folder / ".installed"),  # what a page installs never gets into what runs the tests
            **{f"XDG_{kind.upper()}_HOME": str(folder / f".{kind}") for kind in ("cache", "data", "state")},
            **variables,
        }
        self._state = folder / ".shell"

    def run(self, command: str, exits: int = 0) -> str:
        """Run a command to its end; returns what it printed. Fails where its exit status is another."""
        script = (
            f"[ -e {shlex.quote(str(self._state))} ] && . {shlex.quote(str(self._state))}\n"
            f"{command}\nstatus=$?\n"
            f"{{ export -p; printf 'cd %q\\n' \"$PWD\"; }} > {shlex.quote(str(self._state))}\nexit $status\n"
        )
        process = self._started(["bash", "-c", script])
        try:
            said, _ = process.communicate(timeout=LONGEST_S)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            raise
        assert process.returncode == exits, f"exit status {process.returncode}:\n$ {command}\n{said}"
        return said

    def serve(self, command: str) -> str:
        """Run a command that serves until interrupted: it says how to reach it, then it is interrupted."""
        process = self._started(["bash", "-c", f"exec {command}"])
        said = ""
        try:
            assert process.stdout is not None
            for line in process.stdout:
                said += line
                if line.startswith(("manitwin build ", "http://127.0.0.1:")):
                    break
            else:
                raise AssertionError(f"it ended:\n$ {command}\n{said}")
            process.send_signal(signal.SIGINT)
            said += process.communicate(timeout=60)[0]
        finally:
            process.kill()
            process.wait()
        assert process.returncode == 0 and said.endswith("stopped\n"), said
        return said

    def _started(self, words: list[str]) -> subprocess.Popen[str]:
        return subprocess.Popen(
            words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            cwd=self.folder, env=self.environment, start_new_session=True,
        )  # fmt: skip
