"""What the documents say is run, and what they show is there."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import typer

from manitwin.cli import app

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_and_pictures_lead_somewhere(page: Path) -> None:
    targets = re.findall(r"\]\(([^)#]+)", page.read_text())
    missing = [t for t in targets if "://" not in t and not (page.parent / t).exists()]
    assert not missing


def test_settings_page_is_that_of_the_code() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "docs" / "make_configuration.py", "--check"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_settings_page_shows_defaults_as_toml() -> None:
    rows = re.findall(r"^\| `([\w.]+)` \| (.*?) \|", (ROOT / "docs" / "configuration.md").read_text(), re.MULTILINE)
    assert len(rows) > 60
    written = [(name, tomllib.loads(f"value = {text.strip('`')}")["value"]) for name, text in rows if text != "not set"]
    assert all(default in written for default in (("options", {}), ("cache", True), ("generator", "lift")))


def test_readme_commands_are_those_that_ci_and_tests_run() -> None:
    blocks = re.findall(r"```(?:sh)?\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    commands = {line.split("#")[0].strip() for block in blocks for line in block.splitlines() if line.strip()}
    make_targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert {c.split()[1] for c in commands if c.startswith("make ")} <= make_targets
    assert "make test" in (ROOT / ".ci" / "run").read_text()
    # the others are run here, on the help of the command they name: that it exists and takes these options
    for command in commands:
        if "manitwin" in command.split()[0]:
            words = command.split()
            done = subprocess.run(
                [sys.executable, "-m", "manitwin.cli", words[1], "--help"], capture_output=True, text=True
            )
            assert done.returncode == 0, command
            assert all(option in done.stdout for option in words if option.startswith("--")), command


def _commands(page: Path) -> list[str]:
    blocks = re.findall(r"```(?:sh)?\n(.*?)```", page.read_text(), re.DOTALL)
    lines = [line.split(" #")[0].strip() for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    return [line for line in lines if line.startswith(("manitwin ", ".venv/bin/manitwin "))]


@pytest.mark.parametrize("page", [page for page in PAGES if _commands(page)], ids=lambda p: p.name)
def test_commands_of_the_docs_exist_and_take_what_they_are_given(page: Path) -> None:
    known = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    for line in _commands(page):
        words = shlex.split(line)
        assert words[1] in known, line
        taken = {option for parameter in known[words[1]].params for option in parameter.opts + parameter.secondary_opts}
        given = {word.split("=")[0] for word in words[2:] if re.match(r"--?[a-z]", word)}
        assert given <= taken | {"--help"}, f"{line}: {given - taken}"


def test_python_examples_of_the_docs_compile() -> None:
    examples = [
        (page.name, block)
        for page in PAGES
        for block in re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
    ]
    assert len(examples) >= 3, "the pattern finds them"
    assert all(compile(block, name, "exec") for name, block in examples)
