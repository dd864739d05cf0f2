"""Verbosity and log file: the options of every command that makes something."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer

from manitwin.cli.console import set_quiet, set_verbose
from manitwin.cli.options import with_options
from manitwin.cli.run_log import begin_log
from manitwin.errors import UsageError
from manitwin.formats.installation import installed_version

Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Print more: the stages and their seconds, and what was chosen and why.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only errors.")]
LogFile = Annotated[
    Path | None,
    typer.Option("--log", help="Append all messages to this file, with timestamps.", metavar="FILE", dir_okay=False),
]
OPTIONS = {"verbose": (Verbose, False), "quiet": (Quiet, False), "log": (LogFile, None)}
LOG = logging.getLogger("manitwin.command")

_before_command = (False, False)


def set_global_verbosity(verbose: bool, quiet: bool) -> None:
    """Take what stands before a command's name; ``with_reporting_options`` adds what stands behind it."""
    global _before_command
    _before_command = (verbose, quiet)
    _set_verbosity(verbose, quiet)


def _set_verbosity(verbose: bool, quiet: bool) -> None:
    if verbose and quiet:
        raise UsageError("--verbose and --quiet contradict each other; give one of them")
    set_quiet(quiet)
    set_verbose(verbose)


def with_reporting_options(command: Callable[..., None], own_log: bool = False) -> Callable[..., None]:
    """Return a command that takes ``--verbose``, ``--quiet`` and ``--log`` as well.

    ``own_log``: it has a place for its log (``open_run_log``); of another command nothing is kept without ``--log``.
    """

    @with_options(OPTIONS)
    @wraps(command)
    def call(*, verbose: bool, quiet: bool, log: Path | None, **given: Any) -> None:
        global _before_command
        before, _before_command = _before_command, (False, False)
        _set_verbosity(verbose or before[0], quiet or before[1])
        try:
            begin_log(log, place_follows=own_log)
            LOG.info("manitwin %s: %s", installed_version(), " ".join(sys.argv[1:]))
            command(**given)
        finally:
            _set_verbosity(False, False)  # a process may run more commands than one

    return call
