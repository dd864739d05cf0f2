"""Fixtures shared by all tests."""

from __future__ import annotations

import atexit
import gc
import os
import signal
from collections.abc import Generator, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
import typer.main
import typer.testing

import manitwin.cli.main
from manitwin.cli.console import out_console
from manitwin.engine.process_limits import limit_library_threads
from manitwin.errors import RendererMissing
from manitwin.render.device import require_renderer

limit_library_threads()  # before NumPy is loaded: tests run side by side, and threads of theirs would wait for each other

SHARED_DATA = Path(__file__).resolve().parent.parent.parent / "shared" / "data"

# Workers and programs that tests start import what lies beside this file: the rehearsal's recipe.
_TESTS = str(Path(__file__).resolve().parent)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (_TESTS, os.environ.get("PYTHONPATH"))))

# A shell's background jobs ignore interrupts, those of nohup hang-ups, and so would every program that a test starts and signals.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture(scope="session", autouse=True)
def own_folders_of_a_user(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Let nothing count that somebody keeps on this machine: added weights, cached answers, the places of ledgers."""
    cache_home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MANITWIN_MODELS", raising=False)
        if "MESA_SHADER_CACHE_DIR" not in os.environ:  # dear to compile, and the same for everybody
            patch.setenv("MESA_SHADER_CACHE_DIR", cache_home)
        for kind in ("DATA", "STATE", "CACHE"):
            patch.setenv(f"XDG_{kind}_HOME", str(tmp_path_factory.mktemp(kind.lower())))
        yield


@pytest.fixture(scope="session", autouse=True)
def commands_built_once() -> Iterator[None]:
    """Build the command line once a process: typer evaluates the types of every option at each call, a program calls once."""
    with pytest.MonkeyPatch.context() as patch:
        built = cache(typer.main.get_command)
        patch.setattr(typer.main, "get_command", built)
        patch.setattr(typer.testing, "_get_command", built)
        # an application of the commands that are named is another one at each call: one for each set of them is built
        of_names = cache(manitwin.cli.main.only_asked_for)
        names = {name.split()[0] for name in typer.main.get_command(manitwin.cli.main.app).commands}  # type: ignore[attr-defined]
        patch.setattr(
            manitwin.cli.main,
            "only_asked_for",
            lambda app, words: of_names(app, tuple(sorted(names.intersection(words)))),
        )
        yield


@pytest.fixture(autouse=True)
def commands_print_for_a_person() -> None:
    """Begin each test as a process begins: an earlier one's ``--json`` left what is for a person on stderr."""
    out_console.stderr = False


@pytest.fixture(scope="session", autouse=True)
def renderer_found_once() -> None:
    """Look for a device that renders once a process: programs that tests start are told of it, and need not look again."""
    with suppress(RendererMissing):
        require_renderer()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real meshes and photos; skips without it, fails without it where CI=true."""
    if not SHARED_DATA.is_dir():
        if os.environ.get("CI") == "true":
            pytest.fail(f"the shared test data is missing: {SHARED_DATA}")
        pytest.skip("no shared test data beside the checkout")
    return SHARED_DATA


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let files of whole programs begin first: a long one that begins last leaves all other processes idle."""
    items.sort(key=lambda item: _WHOLE_PROGRAMS.get(item.path.relative_to(_TESTS).parts[0], 2))


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """Keep all that is collected out of the garbage collector: it would look at a million objects again and again."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        atexit.register(gc.unfreeze)  # libraries complain of objects that are left when the process ends
        gc.enable()


_WHOLE_PROGRAMS = {
    **dict.fromkeys(("test_build.py", "test_build_commands.py", "test_bad_inputs.py", "test_served_models.py"), 0),
    **dict.fromkeys(("docs", "fuzz", "examples", "engine", "cli", "web"), 1),
}
"""What begins first of the tests, by folder or file; the rest as collected."""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Escape what no UTF-8 can hold in a report: names of files that are no text end a worker of xdist otherwise."""
    report = yield
    report.sections = [(name, _encodable(text)) for name, text in report.sections]
    text = str(report.longrepr)
    if text != _encodable(text):
        report.longrepr = _encodable(text)
    return report


def _encodable(text: str) -> str:
    return text.encode("utf-8", "backslashreplace").decode()
