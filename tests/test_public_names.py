"""What programs import: the names of ``manitwin`` and ``manitwin.backends``, and that the documentation uses no others."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import pytest

import manitwin
from manitwin import backends

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PUBLIC = {"manitwin": set(manitwin.__all__), "manitwin.backends": set(backends.__all__)}
NO_ATTRIBUTES = {"__all__"}
NAMES_MODULES = {
    "types.md": "documents the records that public functions return, under the modules that define them",
    "protocols.md": "documents manitwin.backends, under the modules that define its names",
    "errors.md": "documents the whole error tree, also what is raised inside alone",
}
"""Pages whose directives for the site's generator name modules, and why: no reader types what is in them."""
FOR_CONTRIBUTORS = {
    "architecture.md": "says where things are in the package, by the names of its modules",
    "threat_model.md": "says where each limit holds, by the name of the constant",
}
"""Pages that name modules in their text, and why; their programs use public names like all others."""


def _python(*lines: str, path: str | None = None) -> str:
    command = [sys.executable, *([] if path is None else ["-S"]), "-c", "\n".join(lines)]
    environment = None if path is None else {"PYTHONPATH": path}
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout.strip()


@pytest.mark.parametrize("name", manitwin.__all__)
def test_every_public_name_is_there(name: str) -> None:
    found = getattr(manitwin, name)
    assert found is not None
    if callable(found):
        assert found.__doc__


def test_completion_finds_every_name_and_imports_nothing_for_it() -> None:
    said = _python(
        "import sys, manitwin",
        "print(set(manitwin.__all__) <= set(dir(manitwin)), [m for m in sys.modules if m.startswith('manitwin.')])",
        "print([m for m in ('numpy', 'pydantic', 'importlib.metadata') if m in sys.modules])",
    )
    assert said.splitlines() == ["True []", "[]"]


def test_completion_offers_public_names_alone() -> None:
    assert {name for name in dir(manitwin) if not (name.startswith("__") and name.endswith("__"))} == set(
        manitwin.__all__
    ) - {"__version__"}


def test_a_name_that_is_not_there_lists_those_that_are() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'biuld'; it has .*\bbuild\b"):
        manitwin.biuld  # noqa: B018


def test_functions_are_not_hidden_by_packages_of_their_name() -> None:
    for name in manitwin.__all__:
        assert not (ROOT / "src" / "manitwin" / name).exists(), name
        assert not (ROOT / "src" / "manitwin" / f"{name}.py").exists(), name


def test_version_is_that_of_the_installed_package() -> None:
    assert manitwin.__version__ == version("manitwin")


def test_version_of_a_source_tree_that_was_never_installed_says_so() -> None:
    assert _python("import manitwin; print(manitwin.__version__)", path=str(ROOT / "src")) == "0+unknown"


def test_types_are_marked_as_there() -> None:
    assert (Path(manitwin.__file__).parent / "py.typed").is_file()


def _wrong_names(source: str) -> list[str]:
    """Return what a program takes from manitwin that is not public."""
    wrong = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            wrong += [a.name for a in node.names if a.name.split(".")[0] == "manitwin" and a.name not in PUBLIC]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "manitwin":
            module = node.module or ""
            public = PUBLIC.get(module, set()) | ({"backends"} if module == "manitwin" else set())
            wrong += [f"{module}.{a.name}" for a in node.names if a.name not in public]
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "manitwin":
            wrong += [f"manitwin.{node.attr}"] if node.attr not in PUBLIC["manitwin"] | {"backends"} else []
    return wrong


def test_what_is_not_public_is_seen() -> None:
    assert _wrong_names("import manitwin.dataset.publish.shards") == ["manitwin.dataset.publish.shards"]
    assert _wrong_names("from manitwin.dataset.index.query import Index") == ["manitwin.dataset.index.query.Index"]
    assert _wrong_names("import manitwin\nmanitwin.nothing()") == ["manitwin.nothing"]
    assert _wrong_names("from manitwin import Dataset\nfrom manitwin.backends import Generator") == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_documents_use_public_names_only(page: Path) -> None:
    text = page.read_text()
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        assert not _wrong_names(block), block
    if page.name in FOR_CONTRIBUTORS:
        return
    prose = re.sub(r"```\{.*?```", "", text, flags=re.DOTALL) if page.name in NAMES_MODULES else text
    for dotted in re.findall(r"(?<![\w/\"'.-])manitwin\.([A-Za-z_][\w.]*)", prose):
        name, _, rest = dotted.rstrip(".").partition(".")
        if name in NO_ATTRIBUTES:
            continue
        if name == "backends" and rest:
            assert rest in PUBLIC["manitwin.backends"], dotted
        else:
            assert name in PUBLIC["manitwin"] | {"backends"}, dotted
        assert name == "backends" or not rest or hasattr(getattr(manitwin, name), rest.split(".")[0]), dotted


def test_every_public_function_is_called_on_a_page() -> None:
    said = "\n".join(page.read_text() for page in PAGES)
    functions = {name for name in manitwin.__all__ if name[0].islower()}
    assert {name for name in functions if f"manitwin.{name}(" not in said} == set()


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "examples").glob("*.py")), ids=lambda page: page.name)
def test_example_programs_use_public_names_only(page: Path) -> None:
    assert not _wrong_names(page.read_text())


def test_every_protocol_of_the_registry_is_among_the_backends() -> None:
    kinds = import_module("manitwin.models.builtin").BACKENDS
    of_kind = {"generator": "Generator", "annotator": "Annotator", "grasper": "Grasper", "simulator": "GraspTrial"}
    assert set(of_kind) <= set(kinds) and set(of_kind.values()) <= set(backends.__all__)
