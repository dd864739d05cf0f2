"""Workers that are forked: what they have of their driver and what they have not, how they end, and when they are spawned."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from manitwin.engine.process_limits import ONE_THREAD

HEAD = """
import json, logging, os, signal, sys, threading, time
from forked_worker import MODULE, started
from manitwin.engine.fork_server import forked_workers, fork_obstacle

def say(said):
    print(json.dumps(said), flush=True)
"""
FORKED = """
logging.getLogger().addHandler(logging.StreamHandler())
signal.signal(signal.SIGTERM, lambda *_: None)
with forked_workers([MODULE]):
    first, one, end = started()
    second, two, _ = started()
    end.send("end")
    one.join()
    two.kill()
    two.join()
    say({"driver": os.getpid(), "workers": [first, second], "exit_codes": [one.exitcode, two.exitcode]})
say({"there": [os.path.exists(f"/proc/{pid}") for pid in (first["parent"], first["pid"], second["pid"])]})
third, process, end = started()
end.send("end")
say({"later": third})
"""
SPAWNED = """
threading.Thread(target=time.sleep, args=(60,), daemon=True, name="sleeper").start()
with forked_workers([MODULE]):
    said, process, end = started()
    end.send("end")
    process.join()
say({"driver": os.getpid(), "worker": said, "why": fork_obstacle(), "known": fork_obstacle(["sleeper"])})
"""
SERVER_KILLED = """
with forked_workers([]):
    first, one, _ = started()
    os.kill(first["parent"], signal.SIGKILL)
    one.join()
    second, two, end = started()
    end.send("end")
    two.join()
say({"driver": os.getpid(), "first": one.exitcode, "worker": second, "second": two.exitcode})
"""
DRIVER_KILLED = """
with forked_workers([]):
    said, process, _ = started()
    say(said)
    time.sleep(60)
"""

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux") or sys.version_info >= (3, 14), reason="workers are spawned there"
)


def program(text: str) -> subprocess.Popen[str]:
    """Start a Python program beside the helper module."""
    places = filter(None, (str(Path(__file__).parent), os.environ.get("PYTHONPATH")))
    unbounded = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
    environment = unbounded | {"PYTHONPATH": os.pathsep.join(places)}
    return subprocess.Popen(
        [sys.executable, "-c", HEAD + text], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )


def said_by(text: str) -> dict[str, Any]:
    """Return all that a program says, which must not complain."""
    out, err = program(text).communicate(timeout=60)
    said: dict[str, Any] = {}
    for line in out.splitlines():
        if line.startswith("{"):
            said |= json.loads(line)
    assert not err and said, err
    return said


def test_forked_workers_share_imports_and_nothing_that_a_program_keeps_to_itself() -> None:
    said = said_by(FORKED)
    first, second = said["workers"]
    assert first["parent"] == second["parent"] != said["driver"]
    for worker in (first, second):
        assert worker["imported"] and worker["blocked"] and worker["terminates"]
        assert (worker["handlers"], worker["threads"]) == (0, "1")
    assert said["exit_codes"] == [0, -signal.SIGKILL]
    assert not any(said["there"]), "the server ends with the workers"
    assert said["later"]["parent"] == said["driver"] and not said["later"]["imported"]


def test_beside_a_thread_that_nobody_knows_workers_are_spawned() -> None:
    said = said_by(SPAWNED)
    assert said["worker"]["parent"] == said["driver"] and not said["worker"]["imported"]
    assert said["why"] == "other threads run: sleeper" and said["known"] is None


def test_where_the_server_is_killed_its_workers_end_and_the_next_one_is_spawned() -> None:
    said = said_by(SERVER_KILLED)
    assert said["first"] != 0 and said["second"] == 0
    assert said["worker"]["parent"] == said["driver"]


def test_where_the_driver_is_killed_the_server_and_its_workers_end() -> None:
    driver = program(DRIVER_KILLED)
    assert driver.stdout is not None
    worker = json.loads(driver.stdout.readline())
    driver.kill()
    driver.communicate()
    until = time.monotonic() + 20
    while any(_runs(pid) for pid in (worker["pid"], worker["parent"])):
        assert time.monotonic() < until
        time.sleep(0.05)


def _runs(pid: int) -> bool:
    """Tell whether a process runs; one that has ended may wait for its new parent to notice."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
