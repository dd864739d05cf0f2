"""The scripts that ``manitwin completion`` prints, and what they get when they ask."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest


def ask(**environment: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-m", "manitwin"], capture_output=True, text=True, env={**os.environ, **environment}
    )
    assert done.stderr == ""
    return done.stdout.split("\n")[:-1]


def script(shell: str) -> str:
    done = subprocess.run([sys.executable, "-m", "manitwin", "completion", shell], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.fixture(scope="module")
def path_with_manitwin(tmp_path_factory: pytest.TempPathFactory) -> str:
    """PATH with a ``manitwin`` that runs this checkout's."""
    folder = tmp_path_factory.mktemp("bin")
    program = folder / "manitwin"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m manitwin "$@"\n')
    program.chmod(0o755)
    return f"{folder}{os.pathsep}{os.environ['PATH']}"


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        pytest.param("manitwin traj", {"trajectories"}, marks=pytest.mark.slow),
        ("manitwin build --qu", {"--quick", "--quiet"}),
        ("manitwin export twins --to mjcf,usd", {"mjcf,usd", "mjcf,usdz"}),
        pytest.param("manitwin build --executor ", {"local", "ray", "inline"}, marks=pytest.mark.slow),
        pytest.param("manitwin build --gripper pan", {"panda"}, marks=pytest.mark.slow),
        ("manitwin trajectories twins --robot xarm", {"xarm7_allegro", "xarm7_panda"}),
        ("manitwin fake rod", {"rodin"}),
    ],
)
def test_bash_completes_commands_options_and_names(typed: str, offered: set[str], path_with_manitwin: str) -> None:
    words = typed.split(" ")
    quoted = " ".join(f"'{word}'" for word in words)
    ask_bash = (
        f"{script('bash')}\nCOMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}\n"
        '_manitwin_completion manitwin\nprintf "%s\\n" "${COMPREPLY[@]}"'
    )
    environment = {**os.environ, "PATH": path_with_manitwin}
    done = subprocess.run(["bash", "--norc", "-c", ask_bash], capture_output=True, text=True, env=environment)
    assert (set(done.stdout.split()), done.stderr) == (offered, "")


def test_zsh_gets_names_with_what_they_are() -> None:
    offered = ask(_MANITWIN_COMPLETE="complete_zsh", _TYPER_COMPLETE_ARGS="manitwin export twins --to sd")
    assert offered == ["_arguments '*: :((\"sdf\"))'"]
    (commands,) = ask(_MANITWIN_COMPLETE="complete_zsh", _TYPER_COMPLETE_ARGS="manitwin traj")
    assert '"trajectories":"Plan and execute' in commands


def test_fish_gets_names_with_what_they_are() -> None:
    fish = {"_MANITWIN_COMPLETE": "complete_fish", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    assert ask(**fish, _TYPER_COMPLETE_ARGS="manitwin build --units c") == ["cm"]
    (command,) = ask(**fish, _TYPER_COMPLETE_ARGS="manitwin traj")
    assert command.startswith("trajectories\tPlan and execute")


@pytest.mark.parametrize(
    ("shell", "asks"), [("bash", "complete_bash"), ("zsh", "complete_zsh"), ("fish", "complete_fish")]
)
def test_script_asks_manitwin_in_the_way_that_it_answers(shell: str, asks: str) -> None:
    printed = script(shell)
    assert f"_MANITWIN_COMPLETE={asks}" in printed and "manitwin" in printed


def test_unknown_shell_is_a_usage_error() -> None:
    done = subprocess.run([sys.executable, "-m", "manitwin", "completion", "tcsh"], capture_output=True, text=True)
    assert done.returncode == 2 and "Valid: bash, fish, zsh" in done.stderr


def test_completing_imports_nothing_heavy(tmp_path: Path) -> None:
    program = (
        "import atexit, sys\n"
        "heavy = ('numpy', 'trimesh', 'sapien', 'mujoco', 'pyarrow', 'scipy', 'fsspec')\n"
        "atexit.register(lambda: sys.stderr.write(' '.join(m for m in heavy if m in sys.modules)))\n"
        "from manitwin.cli.main import main\nmain()\n"
    )
    environment = {"_MANITWIN_COMPLETE": "complete_bash", "COMP_WORDS": "manitwin build --vlm ", "COMP_CWORD": "3"}
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env={**os.environ, **environment}
    )
    assert "openai" in done.stdout and done.stderr == ""
