"""What the documents show is there, and the settings they list are the code's; what they say to do is run by tests/docs."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import typer

import manitwin
from manitwin.cli.main import app

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


def test_the_page_of_building_names_every_option_of_the_command() -> None:
    page = (ROOT / "docs" / "build.md").read_text()
    command = typer.main.get_command(app).commands["build"]  # type: ignore[attr-defined]
    options = {name for each in command.params for name in (*each.opts, *each.secondary_opts) if name.startswith("--")}
    told_elsewhere = {
        "--help",
        "--out",
        "--lines",
        "--verbose",
        "--quiet",
    }  # by their short names, or by their opposite
    missing = {name for name in options - told_elsewhere if not re.search(rf"{name}\b", page)}
    assert "--text" in options and not missing


def test_the_page_of_a_twin_names_every_field_of_its_schema() -> None:
    page = re.sub(r"^```.*?^```$", "", (ROOT / "docs" / "twin.md").read_text(), flags=re.MULTILINE | re.DOTALL)
    named = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`]+)`", page))))
    schema = manitwin.schema()
    fields = {field for each in (schema, *schema["$defs"].values()) for field in each.get("properties", {})}
    assert "scale_applied" in fields and fields - named == set()


OPPOSITES = {"--lines", "--browser", "--retire"}
"""Pages name their opposite, ``--no-lines``: these are the default."""


def test_every_option_of_every_command_is_named_on_a_page() -> None:
    said = "\n".join(page.read_text() for page in PAGES)
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    untold = {
        (name, option)
        for name, command in commands.items()
        for parameter in command.params
        for option in parameter.opts
        if option.startswith("--") and not command.hidden and option not in {"--help", *OPPOSITES}
        if not re.search(rf"(?<![\w-]){option}(?![\w-])", said)
    }
    assert not untold


FROM_OTHER_FILES = {"changelog.md", "contributing.md", "index.md"}


@pytest.mark.parametrize("page", [page for page in PAGES if page.name not in FROM_OTHER_FILES], ids=lambda p: p.name)
def test_a_page_says_what_it_is_about_and_ends_no_section_with_a_colon(page: Path) -> None:
    lines = [line for line in page.read_text().splitlines() if line.strip()]
    assert lines[0].startswith("# ") and re.match(r"[A-Z`*\[]", lines[1]) and not lines[1].startswith("```")
    pairs = zip(lines, [*lines[1:], "#"], strict=True)
    unended = [line for line, following in pairs if line.endswith(":") and following.startswith("#")]
    assert not unended
    begun = re.findall(r"^```\n\n?([a-z].*)", page.read_text(), re.MULTILINE)
    assert not begun, "a sentence has no block of code for its subject"


def test_every_page_can_be_reached_from_the_readme() -> None:
    seen, todo = set[Path](), [ROOT / "README.md"]
    while todo:
        page = todo.pop()
        if page not in seen:
            seen.add(page)
            links = re.findall(r"\]\(([^)#\s:]+\.md)", page.read_text())
            todo += [(page.parent / link).resolve() for link in links]
    assert {page.name for page in PAGES} - {page.name for page in seen} == FROM_OTHER_FILES


def test_readme_make_targets_are_those_that_ci_runs() -> None:
    targets = set(re.findall(r"^make (\w+)", (ROOT / "README.md").read_text(), re.MULTILINE))
    assert targets <= set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert {"demo", "test"} <= targets and "make test" in (ROOT / ".ci" / "run").read_text()
