"""Processes that end in the middle of a job: what was paid for is not paid for again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from generator_runs import USD, Crash, Fuse, FusedGenerator, FusedMemory, Ran, config, memory, run
from manitwin.errors import BadReply
from manitwin.models.fakes.faults import ALWAYS, Faults
from served_vendors import VENDORS, Vendor, serving, set_keys


@pytest.fixture(autouse=True)
def _key(monkeypatch: pytest.MonkeyPatch) -> None:
    set_keys(monkeypatch)


@pytest.fixture(params=sorted(VENDORS))
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_lost_job_is_submitted_again(name: str, tmp_path: Path) -> None:
    with serving(name) as vendor:
        settings = config()
        assert run(vendor.generator(settings), tmp_path, settings).made is not None
        vendor.fake.faults = Faults({"job_lost": 1})
        ran = run(vendor.generator(settings), tmp_path, settings)
        assert ran.made is not None and ran.usd == 2 * USD and vendor.seeds == [7, 7], "both are what this mesh cost"


def _crashed(vendor: Vendor, folder: Path, at: int) -> tuple[Fuse, Ran | None]:
    settings, fuse = config(), Fuse(at)
    folder.mkdir(exist_ok=True)
    try:
        generator = FusedGenerator(vendor.generator(settings), fuse)
        return fuse, run(generator, folder, settings, jobs=FusedMemory(memory(folder), fuse))
    except Crash:
        return fuse, None


def test_job_is_paid_once_whenever_the_process_ends(name: str, tmp_path: Path) -> None:
    at, unknown = 0, []
    while True:
        with serving(name) as vendor:
            folder = tmp_path / f"crash-{at}"
            fuse, ended = _crashed(vendor, folder, at)
            if ended is not None:
                break
            settings = config()
            after = run(vendor.generator(settings), folder, settings)
            assert len(vendor.fake.tasks) <= 1
            if after.made is None:
                assert type(after.error) is BadReply and "was interrupted" in str(after.error)
                unknown.append(fuse.steps[-1])
            else:
                assert len(vendor.fake.tasks) == 1 and after.usd == USD, "a crash loses no cost either"
            assert len(list((folder / "jobs").iterdir())) == 1
        at += 1
    # only where nobody can know whether the job was taken does a person have to say so
    assert unknown == ["after note", "before submit", "after submit", "before note"]
    assert at == len(fuse.steps) == 2 * 8  # recall, note, submit, note, three polls, fetch


def test_job_survives_a_killed_process(name: str, tmp_path: Path) -> None:
    with serving(name) as vendor:
        vendor.fake.faults = Faults({"job_never_ends": ALWAYS})
        program = (
            "import sys, pathlib, time; sys.path.insert(0, sys.argv[4]);"
            "import generator_runs as g; from manitwin.models.generators.run import run_generator;"
            f"from {VENDORS[name][1].__module__} import {VENDORS[name][1].__name__} as G;"
            "s = g.config(); f = pathlib.Path(sys.argv[2]); f.mkdir(); print('begun', flush=True);"
            "run_generator(G.from_spec('@' + sys.argv[1], s), g.photo_request(), f, settings=s.generate,"
            " jobs=g.memory(f), sleep=lambda t: time.sleep(0.05))"
        )
        arguments = [vendor.server.url, str(tmp_path / "run"), "x", str(Path(__file__).parents[2])]
        process = subprocess.Popen([sys.executable, "-c", program, *arguments], stderr=subprocess.PIPE)
        deadline = time.monotonic() + 60
        while not any(task.polls > 2 for task in vendor.fake.tasks.values()):
            assert process.poll() is None and time.monotonic() < deadline, process.communicate()[1].decode()
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()
        vendor.fake.faults = Faults()
        settings = config()
        ran = run(vendor.generator(settings), tmp_path / "run", settings)
        assert ran.made is not None and ran.usd == USD and len(vendor.fake.tasks) == 1
