"""A pose estimator that is a user program: it reads a folder and writes a JSON file.

``command:PROGRAM ARGUMENT...`` is split as a POSIX shell would split it, but no shell runs it. Placeholders: ``{request}``, a
folder with ``request.json`` and the files that it names, and ``{out}``, the JSON file to write.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from manitwin.errors import BadReply, ConfigError, Unavailable, unknown_name_message
from manitwin.formats.json_file import read_json_object
from manitwin.models.generators import supervisor
from manitwin.models.generators.command import passed_environment
from manitwin.models.pose_estimators.protocol import PoseGuesses, PoseRequest, parse_guesses
from manitwin.models.services.keys import redacted

PLACEHOLDERS = ("request", "out")
REQUEST, ANSWER = "request.json", "answer.json"
MAX_ANSWER_BYTES = 1 << 20
_PLACEHOLDER = re.compile(r"\{([a-z_]+)\}")
_TAIL_CHARACTERS = 200


class CommandEstimator:
    """Run a program for each request, with the environment variables that programs of generators receive."""

    def __init__(self, command: str, timeout_s: float):
        """Take a command line; raises ConfigError if it lacks ``{request}`` or ``{out}``."""
        self.spec, self._timeout_s = f"command:{command}", timeout_s
        try:
            self._words = shlex.split(command)
        except ValueError as error:
            raise ConfigError(f"command: {command!r} cannot be split into arguments: {error}") from error
        names = {name for word in self._words for name in _PLACEHOLDER.findall(word)}
        for name in sorted(names - set(PLACEHOLDERS)):
            raise ConfigError(f"command: {unknown_name_message('placeholder', name, PLACEHOLDERS)}")
        if names != set(PLACEHOLDERS):
            raise ConfigError("command: it needs {request} and {out}; give command:PROGRAM {request} {out}")

    def guess(self, request: PoseRequest) -> PoseGuesses:
        """Write the request, run the program to its end, and read its answer.

        Raises Unavailable if the program is missing, fails or takes too long, BadReply if it writes no valid answer.
        """
        if shutil.which(self._words[0]) is None:
            raise Unavailable(f"command: there is no program {self._words[0]!r}; install it, or give its path")
        with tempfile.TemporaryDirectory(prefix="manitwin-pose-") as scratch:
            folder, answer = Path(scratch, "request"), Path(scratch, ANSWER)
            folder.mkdir()
            (folder / REQUEST).write_text(json.dumps(request.document), encoding="utf-8")
            for name, content in request.files.items():
                (folder / name).write_bytes(content)
            values = {"request": str(folder), "out": str(answer)}
            self._run([_PLACEHOLDER.sub(lambda found: values[found[1]], word) for word in self._words], Path(scratch))
            if not answer.is_file():
                raise BadReply("command: the program ended well but wrote nothing to {out}; check its arguments")
            told = read_json_object(answer, BadReply, limit_bytes=MAX_ANSWER_BYTES, name="command: {out}")
        return parse_guesses(told, "command")

    def _run(self, arguments: list[str], scratch: Path) -> None:
        """Run the program under the supervisor; raises Unavailable if it fails or exceeds the timeout."""
        with (scratch / "output.txt").open("wb") as output, (scratch / "errors.txt").open("wb") as errors:
            process = subprocess.Popen(
                [sys.executable, "-I", str(Path(supervisor.__file__)), *arguments],
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=errors,
                env=passed_environment(os.environ, ()),
                start_new_session=True,  # Ctrl-C reaches only this process; the supervisor notices by the pipe
            )
        # leaving this block closes the pipe, upon which the supervisor ends the program
        with process:
            try:
                status = process.wait(self._timeout_s)
            except subprocess.TimeoutExpired as error:
                raise Unavailable(
                    f"command: did not end in {self._timeout_s:g} s and was stopped; run it by hand"
                ) from error
        if status:
            lines = (scratch / "errors.txt").read_text(errors="replace").strip().splitlines()
            said = redacted(lines[-1][-_TAIL_CHARACTERS:], None) if lines else "it said nothing"
            raise Unavailable(f"command: ended with status {status}: {said}; run it by hand")
