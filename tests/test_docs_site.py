"""The site is built as `make docs` builds it: strictly, with everything in it, loading nothing from elsewhere."""

from __future__ import annotations

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
import typer

import manitwin
from manitwin.cli.main import app

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    recipe = re.search(
        r"^docs: setup\n\t@\$\(BIN\)/python (-m sphinx .+)$", (ROOT / "Makefile").read_text(), re.MULTILINE
    )
    assert recipe, "the Makefile says how the site is built"
    out = tmp_path_factory.mktemp("site")
    words = recipe[1].replace("build/doctrees", str(out / "doctrees")).replace("build/docs", str(out / "html")).split()
    assert {"-W", "-n"} <= set(words), "a warning and a reference that leads nowhere fail it"
    done = subprocess.run([sys.executable, *words], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out / "html"


def test_every_page_of_the_docs_is_in_the_site(site: Path) -> None:
    pages = {page.relative_to(DOCS).with_suffix("") for page in DOCS.rglob("*.md")}
    made = {page.relative_to(site).with_suffix("") for page in site.rglob("*.html")}
    assert len(pages) > 25
    assert pages <= made


class Loaded(HTMLParser):
    """The addresses that a browser loads by itself when it shows a page; links that a reader follows are not among them."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "a":
            return
        for name, value in attrs:
            if name in ("src", "href", "srcset", "poster", "data", "content", "style") and value:
                self.addresses.append(value)


def loaded_from_elsewhere(page: str) -> list[str]:
    parser = Loaded()
    parser.feed(page)
    return [address for address in parser.addresses if re.search(r"(^|[\s(\"'=,])(https?:)?//\w", address)]


def test_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    found = {page.name: loaded_from_elsewhere(page.read_text()) for page in site.rglob("*.html")}
    assert {name: addresses for name, addresses in found.items() if addresses} == {}
    for sheet in site.rglob("*.css"):
        assert not re.search(r"(@import|url\()\s*[\"']?(https?:)?//", sheet.read_text()), sheet.name
    for script in site.rglob("*.js"):
        assert not re.search(r"(fetch|import|importScripts)\(\s*[\"'`](https?:)?//", script.read_text()), script.name


def test_what_is_loaded_from_elsewhere_would_be_seen() -> None:
    assert loaded_from_elsewhere('<script src="https://cdn.example/x.js"></script>')
    assert loaded_from_elsewhere('<link rel="stylesheet" href="//fonts.example/x.css"/>')
    assert loaded_from_elsewhere('<img srcset="https://a.example/b.png 2x"/>')
    assert not loaded_from_elsewhere('<a href="https://example.org">to read</a><img src="_images/a.png"/>')


def test_every_public_name_is_in_the_reference(site: Path) -> None:
    page = (site / "api.html").read_text()
    described = {name for name in manitwin.__all__ if f'id="manitwin.{name}"' in page}
    linked = {
        name
        for name in manitwin.__all__
        if re.search(rf'<a class="reference internal" href="\w+\.html#.*manitwin\.{name}<', page)
    }
    assert described | linked == set(manitwin.__all__)
    assert len(described) > 20, "only records and errors are on other pages"
    assert "Build twins from images, meshes, folders, manifests" in page, "with what its docstring says"


def test_every_command_and_its_options_are_in_the_reference(site: Path) -> None:
    page = re.sub(r"<[^>]*>", "", (site / "commands.html").read_text())
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    for name, command in commands.items():
        assert (f"manitwin {name} [OPTIONS]" in page) is not command.hidden, "an old name is not shown"
        if command.hidden:
            continue
        options = [option for parameter in command.params for option in parameter.opts if option.startswith("--")]
        assert [option for option in options if option not in page] == [], name


def test_every_error_and_protocol_is_in_the_reference(site: Path) -> None:
    from manitwin import errors

    page = (site / "errors.html").read_text()
    tree = [name for name, kind in vars(errors).items() if isinstance(kind, type) and issubclass(kind, Exception)]
    assert len(tree) > 10
    assert [name for name in tree if f'id="manitwin.errors.{name}"' not in page] == []
    page = (site / "protocols.html").read_text()
    for name in ("Generator", "Annotator", "Grasper", "GraspTrial", "Exporter"):
        assert re.search(rf'id="manitwin\.[a-z_.]+\.{name}"', page), name
