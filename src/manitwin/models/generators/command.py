"""The generator ``command``: any user program that writes a mesh.

``command:PROGRAM ARGUMENT...`` is split as a POSIX shell would split it, but no shell runs it: the value of a placeholder
stays one argument, whatever characters it contains. Placeholders: ``{image}`` the matted photo (PNG, RGBA), ``{text}`` the
text or name, ``{out}`` the GLB or USDZ file to write (its name ends in .glb), ``{seed}``, ``{folder}`` a scratch folder that
is removed afterwards.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from manitwin.config import BuildConfig, Resource
from manitwin.errors import BadReply, ConfigError, InputError, Rejected, Unavailable, Unsupported, unknown_name_message
from manitwin.formats.image_file import png_of
from manitwin.formats.sniff import sniff
from manitwin.models.generators import supervisor
from manitwin.models.generators.protocol import IMAGE_OR_TEXT, Asked, Generated, GenerationRequest, JobState
from manitwin.models.services.keys import redacted
from manitwin.models.services.refusal import NotFound

PLACEHOLDERS = ("image", "text", "out", "seed", "folder")
PLACEHOLDER = re.compile(r"\{([a-z_]+)\}")
PASSED_VARIABLES = re.compile(r"PATH|HOME|LANG|TMPDIR|LD_LIBRARY_PATH|VIRTUAL_ENV|(CUDA|HF|CONDA)_.*|PYTHON.*")
SECRET_VARIABLE = re.compile(r"KEY|TOKEN|SECRET|PASSWORD", re.IGNORECASE)
ENVIRONMENT_OPTION = "environment"
TRY_LATER = 75  # EX_TEMPFAIL of sysexits.h: the program asks to be run again later
ENDED_BY_SIGNAL = 128
TAIL_BYTES = 1 << 16
FORMATS = ("glb", "usdz")


@dataclass(frozen=True)
class _FinishedJob:
    folder: Path
    state: JobState


class CommandGenerator:
    """Run a program that makes a mesh from an image or a text.

    ``submit`` runs the program to its end; jobs live as long as this object. The program receives the environment variables
    that match ``PASSED_VARIABLES`` and those named by the setting ``generate.options.environment``, and no others, so that it
    sees no keys of other services. HF_TOKEN is passed, since models with gated weights need it. Raises ConfigError for a command
    without ``{out}``, without both ``{image}`` and ``{text}``, or with an unknown placeholder.
    """

    name = "command"
    written_name = "generated.glb"
    """Name of the file that the program writes; its suffix tells the program which format is expected."""
    needs: Resource = "gpu"
    asked_with: frozenset[Asked] = IMAGE_OR_TEXT  # set per instance from the command's placeholders

    def __init__(self, command: str, config: BuildConfig):
        self.words = _split_command(command)
        self.model: str | None = _display_name(self.words)
        self.usd_per_job = config.services.usd_per_job or 0.0
        self.max_wait_s = config.generate.max_wait_s
        self.environment = _passed_names(config.generate.options)
        self._jobs: dict[str, _FinishedJob] = {}
        self._takes = {name for word in self.words for name in PLACEHOLDER.findall(word)}
        self.asked_with = frozenset(
            {"image" if "image" in self._takes else "text"}
        )  # if an image is given, {text} is the object's name

    @classmethod
    def from_spec(cls, argument: str, config: BuildConfig) -> CommandGenerator:
        """Create the generator from the part of a spec after ``command:``."""
        return cls(argument, config)

    def probe(self) -> str:
        """Look for the program without running it; raises Unavailable if it is missing."""
        return f"{self.words[0]} is {self._program()}; it was not run"

    def submit(self, request: GenerationRequest) -> str:
        """Run the program to its end and return the job's id.

        Raises Unavailable if the program cannot be started, does not end within ``generate.max_wait_s``, is ended by a signal
        or asks to be run later (exit status 75). Raises Unsupported if it takes a text and an image is given, or the reverse.
        Any other failure is a failed job.
        """
        self._program()
        folder = Path(tempfile.mkdtemp(prefix="manitwin-command-"))
        try:
            status = self._run(self._arguments(request, folder), folder)
            state = self._state(status, folder)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        if state.state == "failed":
            shutil.rmtree(folder, ignore_errors=True)
        self._jobs[folder.name] = _FinishedJob(folder, state)
        return folder.name

    def poll(self, job_id: str) -> JobState:
        """Return the outcome of the program; raises Gone for a job of another process."""
        return self._job(job_id).state

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Move the mesh into ``folder``; raises BadReply if the program wrote none."""
        made = self._job(job_id).folder / self.written_name
        try:
            self.check(made)
            path = folder / self.written_name
            shutil.move(made, path)
        finally:
            shutil.rmtree(self._jobs.pop(job_id).folder, ignore_errors=True)
        return Generated(path, self.model, {"program": self.model})

    def check(self, made: Path) -> None:
        """Raise BadReply if the written file is missing or not a mesh."""
        _check_mesh(made)

    def _job(self, job_id: str) -> _FinishedJob:
        if job_id not in self._jobs:
            raise NotFound(f"command: job {job_id} ended with the process that began it; run it again")
        return self._jobs[job_id]

    def _program(self) -> str:
        place = shutil.which(self.words[0])
        if place is None:
            raise Unavailable(f"command: there is no program {self.words[0]!r}; install it, or give its path")
        return place

    def _arguments(self, request: GenerationRequest, folder: Path) -> list[str]:
        """Write the picture, and return the arguments with the placeholders replaced."""
        if "image" in self._takes and request.rgba is None:
            raise Unsupported(
                f"command: {self.model} needs an {{image}} and cannot make a mesh from text ({request.text!r});"
                " give a photo, or choose another generator"
            )
        if "image" not in self._takes and request.text is None:
            raise Unsupported(f"command: {self.model} takes a {{text}} and no {{image}}; give a text, or add {{image}}")
        text = request.text or request.name or ""
        if "\0" in text:
            raise Rejected(
                "generator_failed",
                "the text contains a NUL character, which is not possible in an argument",
                "generate",
            )
        image = folder / "image.png"
        if request.rgba is not None:
            image.write_bytes(png_of(request.rgba))
        values = {
            "image": str(image),
            "text": text,
            "out": str(folder / self.written_name),
            "seed": str(request.seed),
            "folder": str(folder),
        }
        return [PLACEHOLDER.sub(lambda found: values[found[1]], word) for word in self.words]

    def _run(self, arguments: list[str], folder: Path) -> int:
        """Run the program under the supervisor and return its exit status; raises Unavailable after ``max_wait_s``."""
        with (folder / "output.txt").open("wb") as output, (folder / "errors.txt").open("wb") as errors:
            process = subprocess.Popen(
                [sys.executable, "-I", str(Path(supervisor.__file__)), *arguments],
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=errors,
                env=passed_environment(os.environ, self.environment),
                start_new_session=True,  # Ctrl-C reaches only this process; the supervisor notices by the pipe
            )
        # leaving this block, also by an exception, closes the pipe, upon which the supervisor ends the program
        with process:
            try:
                return process.wait(self.max_wait_s)
            except subprocess.TimeoutExpired as error:
                raise Unavailable(
                    f"command: {self.model} did not end in {self.max_wait_s:g} s and was stopped; run it again, or"
                    f" raise generate.max_wait_s"
                ) from error

    def _state(self, status: int, folder: Path) -> JobState:
        """Return the job state of an exit status; raises Unavailable if the program may succeed later."""
        said = self._last_line(folder / "errors.txt")
        if status == 0:
            return JobState("done")
        if status == supervisor.NOT_STARTED:
            raise Unavailable(f"command: {self.model} could not be started: {said or 'not found'}; check the command")
        if status == TRY_LATER or status > ENDED_BY_SIGNAL:
            how = "asks to be run later" if status == TRY_LATER else f"was ended by signal {status - ENDED_BY_SIGNAL}"
            raise Unavailable(f"command: {self.model} {how}: {said or 'it said nothing'}")
        return JobState("failed", f"{self.model} ended with status {status}: {said or 'it said nothing'}")

    def _last_line(self, log: Path) -> str:
        with log.open("rb") as stream:
            stream.seek(max(0, log.stat().st_size - TAIL_BYTES))
            lines = stream.read().decode(errors="replace").split("\n")
        said = next((line for line in reversed(lines) if line.strip()), "")
        for name, value in passed_environment(os.environ, self.environment).items():
            if value and SECRET_VARIABLE.search(name):
                said = redacted(said, value)
        return redacted(said, None)


def passed_environment(environment: Mapping[str, str], named: tuple[str, ...]) -> dict[str, str]:
    """Return the environment variables that a program receives: those that match ``PASSED_VARIABLES`` and those in ``named``."""
    return {name: value for name, value in environment.items() if name in named or PASSED_VARIABLES.fullmatch(name)}


def _split_command(command: str) -> tuple[str, ...]:
    """Split a command into arguments; raises ConfigError for missing or unknown placeholders."""
    try:
        words = tuple(shlex.split(command))
    except ValueError as error:
        raise ConfigError(f"command: {command!r} cannot be split into arguments: {error}") from error
    if not words:
        raise ConfigError("command: nothing to run; give command:PROGRAM {image} {out}")
    names = {name for word in words for name in PLACEHOLDER.findall(word)}
    for name in sorted(names - set(PLACEHOLDERS)):
        raise ConfigError(f"command: {unknown_name_message('placeholder', name, PLACEHOLDERS)}")
    if "out" not in names or not names & {"image", "text"}:
        raise ConfigError("command: it needs {out}, and {image} or {text}, among its arguments")
    return words


def _display_name(words: tuple[str, ...]) -> str:
    """Return the display name of a command: its program and script without their folders."""
    named = [Path(word).name for word in words[:2] if not PLACEHOLDER.search(word) and not word.startswith("-")]
    return " ".join(named) or words[0]


def _passed_names(options: Mapping[str, Any]) -> tuple[str, ...]:
    for option in options:
        if option != ENVIRONMENT_OPTION:
            raise ConfigError(
                f"generate.options: {unknown_name_message('option', option, [ENVIRONMENT_OPTION])};"
                " the command takes its options as arguments"
            )
    return tuple(str(options.get(ENVIRONMENT_OPTION, "")).split())


def _check_mesh(path: Path) -> None:
    if not path.is_file():
        raise BadReply("command: the program ended well but wrote nothing to {out}; check its arguments")
    try:
        found = sniff(path)
    except InputError as error:
        raise BadReply(f"command: what the program wrote to {{out}} is not a mesh: {error.detail}") from error
    if found.format not in FORMATS:
        raise BadReply(f"command: the program wrote {found.format} to {{out}}; it must be {' or '.join(FORMATS)}")
