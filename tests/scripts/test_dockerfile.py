"""The Dockerfile takes the steps of a bare machine: what Debian gives, then the project's own set-up."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCKERFILE = (ROOT / "Dockerfile").read_text().replace("\\\n", " ")
GIVEN_BY_DEBIAN = {"python3", "python3-venv", "make", "ca-certificates"}
"""What the README asks for; all else is for the set-up to find out, or it would be missing on a bare machine."""


def steps(instruction: str) -> list[str]:
    """The arguments of an instruction, in order."""
    return re.findall(rf"^{instruction}\s+(.*)$", DOCKERFILE, re.MULTILINE)


def test_debian_gives_only_what_the_readme_asks_for() -> None:
    installed = [
        word
        for step in steps("RUN")
        for command in step.split("&&")
        if "apt-get install" in command
        for word in shlex.split(command)[2:]
        if not word.startswith("-")
    ]
    assert set(installed) == GIVEN_BY_DEBIAN
    assert steps("FROM") == ["debian:12-slim"]


def test_everything_else_is_installed_by_the_set_up() -> None:
    commands = [command.strip() for step in steps("RUN") for command in step.split("&&")]
    assert "make setup" in commands
    assert not any("pip" in command for command in commands)
    assert re.search(r"^setup:", (ROOT / "Makefile").read_text(), re.MULTILINE)


def test_it_starts_the_command_that_the_set_up_made() -> None:
    (folder,) = [place for place in steps("WORKDIR") if place != "/data"]
    assert steps("ENV") == [f'PATH="{folder}/.venv/bin:$PATH"']
    assert steps("ENTRYPOINT") == ['["manitwin"]']


def test_an_environment_of_this_machine_does_not_travel_into_it() -> None:
    ignored = (ROOT / ".dockerignore").read_text().split()
    assert {".venv*", ".git"} <= set(ignored)
