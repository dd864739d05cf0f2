"""``manitwin fake`` as a person uses it."""

from __future__ import annotations

import re
import signal
import subprocess
import sys

import pytest

from manitwin.cli.commands import fake as fake_command
from manitwin.cli.commands.fake import fake
from manitwin.config import ServicesConfig
from manitwin.errors import UsageError
from manitwin.models.fakes.faults import Faults
from manitwin.models.graspers.grasp_server import GraspServer

RUN = "import typer; from manitwin.cli.commands.fake import fake; typer.run(fake)"


def started(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-c", RUN, *arguments], stdout=subprocess.PIPE, text=True)


def lines_of(process: subprocess.Popen[str], count: int) -> list[str]:
    assert process.stdout is not None
    return [process.stdout.readline().rstrip("\n") for _ in range(count)]


def test_it_serves_what_it_says_until_interrupted() -> None:
    process = started("graspgen", "--fault", "hangs=1")
    try:
        where, use = lines_of(process, 2)
        url = re.findall(r"tcp://127\.0\.0\.1:\d+", where)[0]
        assert where == f"graspgen at {url}, until interrupted (Ctrl-C)"
        assert use.endswith(f"--grasper graspgen@{url}")
        server = GraspServer(url, "graspgen", ServicesConfig(timeout_s=60))
        assert server.ask({"action": "health"}) == {"status": "ok"}
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=120)[0] == "stopped\n"
        assert process.returncode == 0
    finally:
        process.kill()
        process.wait()


def test_an_interrupt_while_it_says_how_to_use_it_stops_it_as_well(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    console, before = fake_command.out_console, signal.getsignal(signal.SIGINT)
    said = console.print

    def interrupted(text: str, **options: bool) -> None:
        if text.startswith("manitwin build"):
            signal.raise_signal(signal.SIGINT)
        said(text, **options)

    monkeypatch.setattr(console, "print", interrupted)
    fake("graspgen")
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("manitwin build") and lines[2:] == ["stopped"], "each line once"
    assert signal.getsignal(signal.SIGINT) is before


def test_it_says_the_key_to_set() -> None:
    process = started("meshy", "--key", "msy_rehearsal")
    try:
        _, key, use = lines_of(process, 3)
        assert key == "export MESHY_API_KEY=msy_rehearsal"
        assert "--generator meshy@http://127.0.0.1:" in use
    finally:
        process.kill()
        process.communicate()


def test_every_fault_that_is_listed_can_be_asked_for_and_says_what_it_does(capsys: pytest.CaptureFixture[str]) -> None:
    fake(list_faults=True)
    listed = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert len(listed) > 10 and all(len(meaning.split()) > 1 for meaning in listed.values())
    faults = Faults.parse([f"{word}=1" for word in listed])
    assert [faults.strike(word) for word in listed for _ in range(2)] == [True, False] * len(listed)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "no service given; give one of openai"),
        ({"name": "grasp"}, "unknown server 'grasp'"),
        ({"name": "graspgen", "fault": ["explodes"]}, "unknown fault 'explodes'"),
        ({"name": "graspgen", "fault": ["hangs=often"]}, "give a name, or name=times"),
    ],
)
def test_wrong_use_is_said(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        fake(**{"port": 0, **arguments})  # type: ignore[arg-type]
