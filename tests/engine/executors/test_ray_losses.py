"""Nodes, drivers and the head of a cluster die in the middle of a run, and every item ends once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from cluster_runs import executor_for, replies, run, stage_job, times_run

from manitwin.engine.events import ItemEnded
from manitwin.engine.jobs import Failure
from rehearsal_recipe import RehearsalRecipe


@pytest.mark.slow
def test_a_node_that_dies_takes_no_item_along(
    connected: str, machines: Any, tmp_path: Path, recipe: RehearsalRecipe
) -> None:
    second = machines.add()
    killed_after: list[int] = []

    def heard(event: ItemEnded) -> None:
        if len(ended) == 10:
            machines.kill(second)
            killed_after.append(len(times_run(tmp_path / "log")))
        ended.append(event.task.number)

    ended: list[int] = []
    texts = [f"{n} sleep:a:0.1 sleep:b:0.3 sleep:c:0.1" for n in range(40)]
    ran = run(tmp_path, texts, recipe=recipe, address=connected, on_ended=heard)
    assert killed_after, "it died in the middle of the run"
    assert Counter(ran.states.values()) == {"accepted": 40}
    assert Counter(ended).most_common(1)[0][1] == 1, "every item ended once"
    repeated = {what: count for what, count in times_run(tmp_path / "log").items() if count > 1}
    assert len(repeated) <= 2 and set(repeated.values()) <= {2}, "only what its two cores worked on ran twice"
    assert set(ran.attempts.values()) == {1}, "a dead node is nobody's failed attempt"
    assert ran.wrong == []


DRIVE = """
import sys
from pathlib import Path
from manitwin.config import RunConfig
from manitwin.engine.driver import Driver
from manitwin.engine.jobs import WorkerSetup
from rehearsal_recipe import RehearsalRecipe
from manitwin.engine.executors.ray_cluster import RayExecutor
from manitwin.engine.ledger.ledger import Ledger
from manitwin.pipeline.item import Item

address, root, log, count, gate = sys.argv[1:]
recipe = RehearsalRecipe((("a", "cpu"), ("b", "cpu"), ("c", "cpu")), log=Path(log))
settings = RunConfig(index_every=10**6)
ledger = Ledger(Path(root) / "ledger.sqlite")
free = int(count) // 3  # the others wait, so that the driver lives until it is killed
ledger.add_items(Item(file=None, text=f"{n}" if n < free else f"{n} wait:b:{gate}") for n in range(int(count)))
with RayExecutor(WorkerSetup(root, recipe, Path(root) / "cache", True), settings, address) as executor:
    Driver(ledger, executor, recipe, settings).run()
"""


@pytest.mark.slow
def test_a_run_goes_on_where_its_driver_was_killed(connected: str, tmp_path: Path, recipe: RehearsalRecipe) -> None:
    log, gate, count = tmp_path / "log", tmp_path / "gate", 12
    driver = subprocess.Popen([sys.executable, "-c", DRIVE, connected, str(tmp_path), str(log), str(count), str(gate)])
    while len(times_run(log)) < 15:
        time.sleep(0.05)
        assert driver.poll() is None
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    before = times_run(log)
    gate.touch()
    ran = run(tmp_path, (), recipe=recipe, address=connected)
    assert Counter(ran.states.values()) == {"accepted": count}
    after = times_run(log)
    repeated = {what for what, times in after.items() if times > 1}
    assert 0 < len(before) < 3 * count and len(repeated) <= 2 and max(after.values()) <= 2, "what its cores worked on"
    assert set(ran.attempts.values()) == {1}
    assert ran.wrong == []


@pytest.mark.slow
def test_a_machine_that_falls_silent_takes_no_job_along(
    connected: str, machines: Any, tmp_path: Path, recipe: RehearsalRecipe
) -> None:
    second = machines.add()
    with executor_for(tmp_path, recipe, connected) as executor:
        for ticket in range(4):
            executor.submit(ticket, stage_job(ticket, f"{ticket} sleep:a:20", recipe))
        while len(times_run(tmp_path / "log")) < 4:
            assert executor.ended(0.2) == []
        machines.freeze(second)
        answers = dict(replies(executor, 4))
        machines.kill(second)
    lost = [reply for reply in answers.values() if isinstance(reply, Failure)]
    assert [reply.kind for reply in lost] == ["unavailable"] * 2


@pytest.mark.slow
def test_a_lost_head_ends_the_run_and_a_new_one_resumes_it(
    start_machines: Callable[[], Any], tmp_path: Path, recipe: RehearsalRecipe
) -> None:
    first, second = start_machines(), start_machines()
    log, gate = tmp_path / "log", tmp_path / "gate"
    command = [sys.executable, "-c", DRIVE, first.address, str(tmp_path), str(log), "200", str(gate)]
    driver = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while len(times_run(log)) < 25:
        time.sleep(0.05)
        assert driver.poll() is None
    os.kill(first.cluster.head_node.all_processes["gcs_server"][0].process.pid, signal.SIGKILL)
    _, said = driver.communicate(timeout=300)
    assert "Unavailable: the head of the Ray cluster is lost" in said.strip().splitlines()[-1]
    gate.touch()
    ran = run(tmp_path, (), recipe=recipe, address=second.address)
    assert Counter(ran.states.values()) == {"accepted": 200}


@pytest.mark.slow
def test_without_an_address_a_cluster_is_started_and_ended(tmp_path: Path) -> None:
    log = tmp_path / "log"
    before = set(Path("/tmp").glob("mt-*"))
    script = DRIVE.replace(", address)", ", None)")
    subprocess.run([sys.executable, "-c", script, "-", str(tmp_path), str(log), "4", str(tmp_path)], check=True)
    assert Counter(times_run(log).values()) == {1: 12}
    assert set(Path("/tmp").glob("mt-*")) == before
