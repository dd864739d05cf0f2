"""Machines die, meshes crash native code, disks fill: after each, run again, and every item has ended once."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from rehearsals import Rehearsed, rehearse, runs

from manitwin.config import RunConfig
from manitwin.engine.rehearsal import RehearsalRecipe
from manitwin.errors import UsageError
from manitwin.ledger.ledger import Ledger

SLOTS = 2
UNDER_WAY = 2 * SLOTS  # of which half run, and half wait beside them


@pytest.fixture
def recipe(tmp_path: Path) -> RehearsalRecipe:
    return RehearsalRecipe(log=tmp_path / "log")


def settings(**values: float) -> RunConfig:
    return RunConfig(cpu=SLOTS, vlm=8, **values)  # type: ignore[arg-type]


def children() -> list[int]:
    """The process ids of this process' spawned workers."""
    path = Path(f"/proc/{os.getpid()}/task")
    found = [pid for task in path.iterdir() for pid in (task / "children").read_text().split()]
    return [int(pid) for pid in found if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def all_ended_once(run: Rehearsed, root: Path, count: int) -> bool:
    """Every item has ended, has one folder, and ledger, folders and tables agree."""
    folders = list((root / "twins").glob("*/*/twin.json"))
    return len(run.states) == count == len(folders) and "open" not in run.states.values() and run.wrong == []


def test_a_mesh_that_crashes_native_code_costs_itself_alone(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    texts = [f"good {n}" for n in range(6)] + ["poisoned segfault:b", "once segfault-once:b"]
    run = rehearse(tmp_path / "d", texts, recipe=recipe, settings=settings(), processes=True)
    assert {text for text, state in run.states.items() if state != "accepted"} == {"poisoned segfault:b"}
    assert run.attempts["poisoned segfault:b", "b"] == 3
    error = run.errors["poisoned segfault:b", "b"] or ""
    assert "SIGSEGV" in error and "rehearsal.py" in error, "the native stack is kept"
    assert run.attempts["once segfault-once:b", "b"] == 2
    assert run.wrong == []


def test_killed_workers_cost_an_attempt_of_what_they_were_at(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    texts = [f"item {n} sleep:b:0.3" for n in range(8)]
    killed: list[int] = []

    def kill_one_now_and_then() -> None:
        while len(killed) < 2:
            time.sleep(0.2)
            # a worker that is at a stage, not one that only starts
            if sum(stage == "b" for _, stage in runs(tmp_path / "log")) >= 2 * len(killed) + 1:
                victim = children()[-1]
                os.kill(victim, signal.SIGKILL)
                killed.append(victim)

    killer = threading.Thread(target=kill_one_now_and_then)
    killer.start()
    run = rehearse(tmp_path / "d", texts, recipe=recipe, settings=settings(), processes=True)
    killer.join()
    assert all_ended_once(run, tmp_path / "d", 8) and set(run.states.values()) == {"accepted"}
    assert sum(count - 1 for count in run.attempts.values()) <= 2
    assert sum(count - 1 for count in runs(tmp_path / "log").values()) <= 2


def test_a_hang_ends_with_the_time_limit(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    limits = settings(stage_timeout_s=1.5, attempts=1)
    run = rehearse(tmp_path / "d", ["bad hang:b", "good"], recipe=recipe, settings=limits, processes=True)
    assert run.states == {"bad hang:b": "failed", "good": "accepted"}
    assert "stage_timeout_s" in (run.errors["bad hang:b", "b"] or "")


DRIVER = """
import sys
from pathlib import Path
from manitwin.config import RunConfig
from manitwin.engine.rehearsal import RehearsalRecipe
from rehearsals import rehearse
root = Path(sys.argv[1])
rehearse(root, recipe=RehearsalRecipe(log=Path(sys.argv[2])), settings=RunConfig(cpu=2, index_every=5), processes=True,
         texts=[f"item {n} sleep:b:0.05" for n in range(30)])
"""


def test_a_killed_driver_loses_what_was_running_and_nothing_else(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    root, log = tmp_path / "d", tmp_path / "log"
    environment = {**os.environ, "PYTHONPATH": f"{Path(__file__).parent}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    killed = 0
    while killed < 3:
        driver = subprocess.Popen([sys.executable, "-c", DRIVER, str(root), str(log)], env=environment)
        begun, wanted = sum(runs(log).values()), 15
        while driver.poll() is None and sum(runs(log).values()) < begun + wanted:
            time.sleep(0.02)
        assert driver.poll() is None, "it did not live long enough to be killed"
        driver.send_signal(signal.SIGKILL)
        driver.wait()
        killed += 1
        time.sleep(0.3)
        after = sum(runs(log).values())
        time.sleep(0.5)
        assert sum(runs(log).values()) == after, "its workers died with it"
    run = rehearse(root, recipe=recipe, settings=settings(), processes=True)
    assert all_ended_once(run, root, 30) and set(run.states.values()) == {"accepted"}
    repeated = {key: count for key, count in runs(log).items() if count > 1}
    assert sum(repeated.values()) - len(repeated) <= 3 * SLOTS, "only what was running is done twice"
    assert set(run.attempts.values()) == {1}, "a killed driver is nobody's failed attempt"


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 3 MB; skips where this user may not mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = shutil.which("mount")
    command = [mount or "mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(disk)]
    if mount is None or subprocess.run(command, capture_output=True).returncode != 0:
        pytest.skip("a file system cannot be mounted here")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=True)


@pytest.mark.parametrize("ledger_on_it", [True, False])
def test_a_full_disk_stops_the_run_and_leaves_nothing_half_written(
    tmp_path: Path, recipe: RehearsalRecipe, small_disk: Path, ledger_on_it: bool
) -> None:
    recipe = replace(recipe, size=100_000)
    root = small_disk / "d"
    folder = root if ledger_on_it else tmp_path / "ledger"
    texts = [f"item {n}" for n in range(20)]  # 6 MB of results
    first = rehearse(root, texts, recipe=recipe, settings=settings(), processes=True, ledger_folder=folder)
    assert first.result.stopped is not None
    assert "full" in first.result.stopped or "No space left" in first.result.stopped
    assert "make room" in first.result.stopped
    assert "failed" not in first.states.values()
    assert [wrong for wrong in first.wrong if "half" in wrong or "without" in wrong] == []
    subprocess.run(["mount", "-o", "remount,size=60m", str(small_disk)], check=True)
    second = rehearse(root, recipe=recipe, settings=settings(), processes=True, ledger_folder=folder)
    assert all_ended_once(second, root, 20) and set(second.states.values()) == {"accepted"}


def test_items_that_wait_for_a_service_hold_no_core(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    recipe = replace(recipe, plan=(("a", "cpu"), ("ask", "vlm"), ("c", "cpu")))
    texts = [f"item {n} sleep:ask:2" for n in range(6)]
    run = rehearse(tmp_path / "d", texts, recipe=recipe, settings=settings(), processes=True)
    assert set(run.states.values()) == {"accepted"}
    order = [line.split()[1] for line in (tmp_path / "log").read_text().splitlines()]
    # with two cores held by two that wait, the third item could not have begun before the first was answered
    assert max(n for n, stage in enumerate(order) if stage == "a") < min(
        n for n, stage in enumerate(order) if stage == "c"
    )


def test_two_runs_on_one_data_set_are_one_too_many(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    ledger = Ledger(tmp_path / "d" / "ledger.sqlite")
    with pytest.raises(UsageError, match="another run"):
        Ledger(tmp_path / "d" / "ledger.sqlite")
    ledger.close()
