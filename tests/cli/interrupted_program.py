"""A command that a test interrupts: ``python interrupted_program.py NAME FOLDER MODE``, registered in the command line.

It notes in FOLDER that it is at work (``started``) and that it is ending (``ending``). MODE ``busy`` computes until it is
interrupted; ``slow`` then takes for ever over its end, ``deaf`` too, in native code; ``lost`` has the first one come where Python
drops it, ``import`` has it come in a module that goes on without another one, ``imports`` imports for ever; ``late`` gets a
second one as Python takes the process down; ``run`` has two workers asleep in a stage; ``native`` is in native code; ``server``
serves, and waits longer for its last answers than native code may take; ``listing``, ``manifest`` and ``inspection`` look at
inputs.
"""

from __future__ import annotations

import ctypes
import importlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NoReturn

import manitwin.cli.main as cli
from manitwin.cli.interrupt import NATIVE_PATIENCE_S, call_on_first_interrupt
from manitwin.cli.progress import RunDisplay
from manitwin.cli.reporting import with_reporting_options

NAME, FOLDER, MODE = sys.argv[1], Path(sys.argv[2]), sys.argv[3]


def work() -> None:
    try:
        if MODE == "run":
            rehearse()
        if MODE in ("listing", "manifest", "inspection"):
            look_at_inputs()
        if MODE == "server":
            serve()
            return
        (FOLDER / "started").touch()
        if MODE == "native":
            be_deaf()
        if MODE == "lost":
            Dropping()
        if MODE == "import":
            sys.path.insert(0, str(FOLDER))
            (FOLDER / "careless.py").write_text(CARELESS)
            importlib.import_module("careless")
        if MODE == "imports":
            sys.path.insert(0, str(FOLDER))
            (FOLDER / "endless.py").write_text(
                f"open({str(FOLDER / 'importing')!r}, 'w').close()\nwhile True: sum(range(100))"
            )
            importlib.import_module("endless")
        while True:
            sum(range(1000))
    finally:
        (FOLDER / "ending").touch()
        while MODE == "slow":
            time.sleep(0.01)
        if MODE == "deaf":
            be_deaf()


CARELESS = """
import os, signal
try:
    os.kill(os.getpid(), signal.SIGINT)
    import statistics
    sum(range(1000))
except BaseException:
    statistics = None
if statistics is None:
    os.write(2, b"the module goes on without another one")
"""


def be_deaf() -> NoReturn:
    """Wait in native code, which answers no signal and lets other threads run."""
    while True:
        ctypes.CDLL(None).usleep(1_000)
        ctypes.CDLL(None).sem_wait(ctypes.byref(ctypes.create_string_buffer(64)))


class Dropping:
    """Is interrupted as it is collected, whose exceptions Python prints and drops."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


def serve() -> None:
    stop = threading.Event()
    with call_on_first_interrupt(stop.set, (signal.SIGINT,)):
        (FOLDER / "started").touch()
        stop.wait()
        time.sleep(NATIVE_PATIENCE_S + 1.0)


class InterruptsWhenTakenDown:
    """Interrupts this process as the modules' names are removed, which is the last that Python does."""

    def __del__(
        self, kill: Callable[[int, int], None] = os.kill, number: int = signal.SIGINT, me: int = os.getpid()
    ) -> None:
        kill(me, number)


def look_at_inputs() -> None:
    """Read inputs of a build that have no end: folders in folders, rows of a manifest, a file that is never inspected."""
    from manitwin.pipeline import folder_listing, inspection, manifest, manifest_rows

    def endless(*arguments: object, **options: object) -> Iterator[tuple[int, dict[str, str]]]:
        (FOLDER / "started").touch()
        while True:
            yield 1, {"text": "a mug"}

    if MODE == "manifest":
        manifest_rows.read_csv = endless
        (FOLDER / "list.csv").touch()
        for _ in manifest.iterate_items([FOLDER / "list.csv"], {}, manifest.Notes()):
            pass
    if MODE == "listing":
        scan = folder_listing.os.scandir

        def again(folder: Path) -> Any:
            (FOLDER / "started").touch()
            (FOLDER / "in/in").mkdir(parents=True, exist_ok=True)
            return scan(FOLDER / "in")

        folder_listing.os.scandir = again
        folder_listing.list_folder(FOLDER)
    (FOLDER / "started").touch()
    inspection.run_isolated("time:sleep", 1000)


def rehearse() -> None:
    from manitwin.config import RunConfig
    from manitwin.engine.drive import drive
    from manitwin.pipeline.item import Item
    from manitwin.twin.dataset_root import DatasetRoot
    from rehearsal_recipe import RehearsalRecipe

    root = DatasetRoot(FOLDER / "data")
    # a worker writes the log as it begins a stage, and no item ends
    recipe = RehearsalRecipe(log=FOLDER / "started", files={})
    items = [Item(file=None, text=f"{n} sleep:a:600") for n in range(4)]
    with RunDisplay("items", root.url) as watched:
        drive(recipe, items, root, RunConfig(cpu=2), configuration={}, on_start=watched.start)


if __name__ == "__main__":
    last = InterruptsWhenTakenDown() if MODE == "late" else None
    cli.app.registered_commands = [each for each in cli.app.registered_commands if each.callback.__name__ != NAME]
    cli.app.command(NAME)(with_reporting_options(work, own_log=NAME in ("run", "trajectories")))
    sys.argv = ["manitwin", NAME]
    cli.main()
