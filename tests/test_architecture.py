"""The page of the architecture, held against the tree, the contract of imports, and a build that is watched on its way."""

from __future__ import annotations

import inspect
import re
import tomllib
import traceback
from collections.abc import Callable
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

import grimp
import pytest
from typer.testing import CliRunner

from manitwin.cli.main import app
from manitwin.dataset.index import parts
from manitwin.errors import InputError
from manitwin.pipeline import mesh, recipe
from manitwin.twin.dataset_root import DatasetRoot

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "manitwin"
PAGE = (ROOT / "docs" / "architecture.md").read_text()
(CONTRACT,) = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
MOST_PACKAGES, MOST_MODULES, MOST_FILES_BEFORE_GEOMETRY = 17, 4, 6


def packages() -> set[str]:
    return {path.parent.name for path in PACKAGE.glob("*/__init__.py")}


def section(title: str) -> str:
    return PAGE.split(f"## {title}\n")[1].split("\n## ")[0]


def named_files(text: str) -> list[str]:
    return re.findall(r"\]\(\.\./src/manitwin/([\w/]+\.py)\)", text)


def test_every_package_is_a_room_of_the_page_and_every_room_is_there() -> None:
    assert re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE) == [
        name for layer in CONTRACT["layers"] for name in layer.split(" | ") if name in packages()
    ]
    assert packages() == set(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE))


def test_top_level_stays_small_and_the_page_names_all_of_it() -> None:
    modules = {path.name for path in PACKAGE.glob("*.py")}
    assert len(packages()) <= MOST_PACKAGES and len(modules) <= MOST_MODULES
    assert all(f"`{name}`" in PAGE for name in modules)


def test_contract_on_the_page_is_the_one_that_is_checked() -> None:
    assert f"`{' > '.join(CONTRACT['layers'])}`" in PAGE
    assert CONTRACT["type"] == "layers" and CONTRACT["exhaustive"] and CONTRACT["exhaustive_ignores"] == ["__main__"]


def test_the_one_exception_is_named_and_needed() -> None:
    (exception,) = CONTRACT["ignore_imports"]
    assert f"`{exception}`" in PAGE
    importer, imported = (name.strip() for name in exception.split("->"))
    source = (PACKAGE.parent / f"{importer.replace('.', '/')}.py").read_text()
    assert re.search(rf"^ +from {re.escape(imported)} import", source, re.MULTILINE), "imported when it is called"


def test_every_path_on_the_page_is_there() -> None:
    said = set(re.findall(r"`((?:[a-z_]+/)+(?:[a-z_]+\.py)?)`", PAGE))
    assert len(said) > 10
    assert [name for name in said if not (PACKAGE / name).exists()] == []


def test_no_modules_import_each_other_not_even_in_functions_or_for_types() -> None:
    graph = grimp.build_graph("manitwin", cache_dir=None)
    imported = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    order = list(TopologicalSorter(imported).static_order())  # a circle raises CycleError, which names its modules
    assert set(order) == set(imported) and graph.count_imports() > len(imported)


Stacks = dict[str, list[str]]


@pytest.fixture(scope="module")
def stacks(tmp_path_factory: pytest.TempPathFactory) -> Stacks:
    """The package's files on the call stack, outermost first, where a build reaches geometry, and where it ends."""
    found: Stacks = {}

    def watched(owner: Any, name: str, answer: Callable[..., Any] | None = None) -> None:
        original = getattr(owner, name)

        def call(*arguments: Any, **options: Any) -> Any:
            frames = [*(frame.filename for frame in traceback.extract_stack()), str(inspect.getsourcefile(original))]
            found[name] = list(dict.fromkeys(f.split("/src/manitwin/")[1] for f in frames if "/src/manitwin/" in f))
            return (answer or original)(*arguments, **options)

        patch.setattr(owner, name, call)

    def rejected(*arguments: Any, **options: Any) -> Any:
        raise InputError("no_faces", "seen")  # what comes after is the way of every item

    out = tmp_path_factory.mktemp("way") / "dataset"
    with pytest.MonkeyPatch.context() as patch:
        watched(mesh, "repair", rejected)
        watched(recipe, "assemble")
        watched(DatasetRoot, "put_folder")
        watched(parts, "write_part")
        CliRunner().invoke(app, ["build", str(ROOT / "samples" / "mug.glb"), "-o", str(out), "--executor", "inline"])
    return found


def test_a_mesh_passes_the_files_of_the_page_before_its_first_geometry(stacks: Stacks) -> None:
    before, then = section("The way of a mesh").split("Then [", 1)
    way = stacks["repair"]
    way = way[way.index("cli/commands/build.py") :]
    assert way[-1].startswith("geometry/")
    assert [*named_files(before), named_files("[" + then)[0]] == way[:-1]
    assert len(named_files(before)) <= MOST_FILES_BEFORE_GEOMETRY


def test_a_twin_passes_the_files_of_the_page_to_its_folder_and_the_tables(stacks: Stacks) -> None:
    passed = {file for stack in stacks.values() for file in stack}
    rest = section("The way of a mesh").split("Then [", 1)[1].split("Layouts, episodes")[0]
    assert set(named_files(rest)) <= passed
    assert set(stacks) == {"repair", "assemble", "put_folder", "write_part"}
