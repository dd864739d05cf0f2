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
from manitwin.engine.ledger.ledger import Ledger
from manitwin.errors import UsageError
from manitwin.pipeline.item import Item
from rehearsal_recipe import RehearsalRecipe

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
    assert "SIGSEGV" in error and "rehearsal_recipe.py" in error, "the native stack is kept"
    assert run.attempts["once segfault-once:b", "b"] == 2
    assert run.wrong == []


def test_killed_workers_cost_an_attempt_of_what_they_were_at(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    gate = tmp_path / "gate"
    free, held = [f"item {n}" for n in range(6)], [f"item {n} wait:b:{gate}" for n in range(6, 8)]
    held_ids = [recipe.identify(Item(file=None, text=text)).item_id for text in held]
    killed: list[int] = []

    def kill_twice() -> None:
        while len(killed) < 2:
            time.sleep(0.02)
            # the two that wait hold both workers: what is killed is at a stage, and not one that only starts
            begun = runs(tmp_path / "log")
            if sum(begun[twin_id, "b"] for twin_id in held_ids) == 2 + len(killed):
                killed.append(children()[-1])
                os.kill(killed[-1], signal.SIGKILL)
        gate.touch()

    killer = threading.Thread(target=kill_twice, daemon=True)
    killer.start()
    run = rehearse(tmp_path / "d", [*free, *held], recipe=recipe, settings=settings(), processes=True)
    assert len(killed) == 2
    assert all_ended_once(run, tmp_path / "d", 8) and set(run.states.values()) == {"accepted"}
    assert sum(count - 1 for count in run.attempts.values()) <= 2
    assert sum(count - 1 for count in runs(tmp_path / "log").values()) <= 2


def test_a_hang_ends_with_the_time_limit(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    limits = settings(stage_timeout_s=5, attempts=1)
    run = rehearse(tmp_path / "d", ["bad hang:b", "good"], recipe=recipe, settings=limits, processes=True)
    assert run.states == {"bad hang:b": "failed", "good": "accepted"}
    assert "stage_timeout_s" in (run.errors["bad hang:b", "b"] or "")


DRIVER = """
import sys
from pathlib import Path
from manitwin.config import RunConfig
from rehearsal_recipe import RehearsalRecipe
from rehearsals import rehearse
root = Path(sys.argv[1])
rehearse(root, recipe=RehearsalRecipe(log=Path(sys.argv[2])), settings=RunConfig(cpu=2, index_every=5), processes=True,
         texts=[f"item {n}" for n in range(29)] + [f"the last wait:b:{sys.argv[3]}"])
"""


def wait_for_the_end_of_group(group: int) -> None:
    """Return when no process of a process group is left but zombies."""
    while any(_group_of(stat) == group for stat in Path("/proc").glob("[0-9]*/stat")):
        time.sleep(0.02)


def _group_of(stat: Path) -> int | None:
    """Return the process group of a running process; proc(5): after the name in brackets state, parent and group."""
    try:
        state, _, group = stat.read_text().rpartition(")")[2].split()[:3]
    except (OSError, ValueError):  # it has ended meanwhile
        return None
    return None if state == "Z" else int(group)


@pytest.mark.slow
def test_a_killed_driver_loses_what_was_running_and_nothing_else(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    root, log, gate = tmp_path / "d", tmp_path / "log", tmp_path / "gate"
    environment = {**os.environ, "PYTHONPATH": f"{Path(__file__).parent}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    killed = 0
    while killed < 3:
        command = [sys.executable, "-c", DRIVER, str(root), str(log), str(gate)]
        driver = subprocess.Popen(command, env=environment, start_new_session=True)
        begun, wanted = sum(runs(log).values()), 15
        while driver.poll() is None and sum(runs(log).values()) < begun + wanted:
            time.sleep(0.02)
        assert driver.poll() is None, "it did not live long enough to be killed"
        driver.send_signal(signal.SIGKILL)
        driver.wait()
        killed += 1
        wait_for_the_end_of_group(driver.pid)  # its workers die with it
    gate.touch()
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


@pytest.mark.parametrize("ledger_on_it", [True, pytest.param(False, marks=pytest.mark.slow)])
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
    assert "free disk space" in first.result.stopped
    assert "failed" not in first.states.values()
    assert [wrong for wrong in first.wrong if "half" in wrong or "without" in wrong] == []
    subprocess.run(["mount", "-o", "remount,size=60m", str(small_disk)], check=True)
    second = rehearse(root, recipe=recipe, settings=settings(), processes=True, ledger_folder=folder)
    assert all_ended_once(second, root, 20) and set(second.states.values()) == {"accepted"}


@pytest.mark.slow
def test_items_that_wait_for_a_service_hold_no_core(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    recipe = replace(recipe, plan=(("a", "cpu"), ("ask", "vlm"), ("c", "cpu")))
    answered = tmp_path / "answered"
    texts = [f"item {n} wait:ask:{answered}" for n in range(6)]

    def answer_when_all_ask() -> None:
        while sum(stage == "ask" for _, stage in runs(tmp_path / "log")) < 6:
            time.sleep(0.02)
        answered.touch()

    # with two cores held by two that wait, the third would never ask, and all would fail at their limit
    threading.Thread(target=answer_when_all_ask, daemon=True).start()
    limits = settings(stage_timeout_s=120, attempts=1)
    run = rehearse(tmp_path / "d", texts, recipe=recipe, settings=limits, processes=True)
    assert set(run.states.values()) == {"accepted"}


def test_two_runs_on_one_data_set_are_one_too_many(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    ledger = Ledger(tmp_path / "d" / "ledger.sqlite")
    with pytest.raises(UsageError, match="another run"):
        Ledger(tmp_path / "d" / "ledger.sqlite")
    ledger.close()
