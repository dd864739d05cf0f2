"""The programs and notebooks of examples/, run as they are: in order, in one folder, by the interpreter of the tests."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

import manitwin
from grasped_twins import write_brick

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"


def run(program: str, folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, EXAMPLES / program, *arguments], cwd=folder, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder in which the first program has built its twin, and what it printed."""
    folder = tmp_path_factory.mktemp("examples")
    return folder, run("build_and_read.py", folder, "twins")


def test_build_and_read_prints_numbers_with_their_sources(built: tuple[Path, str]) -> None:
    _, printed = built
    assert printed.startswith("accepted")
    assert re.search(r"mass_kg +0\.\d+, between 0\.\d+ and 0\.\d+, by prior:mug", printed)
    assert re.search(r"grasps +\d+ hold", printed)
    assert "parallel_jaw" in printed


def test_verified_grasps_lift_the_twin_in_a_plain_mujoco_scene(built: tuple[Path, str]) -> None:
    printed = run("grasps_in_mujoco.py", built[0], "twins")
    found = re.search(r"(\d+) of 10 verified grasps lift 'mug'", printed)
    assert found and int(found[1]) >= 8, printed


def test_the_mujoco_scene_can_say_that_a_grasp_misses(built: tuple[Path, str], tmp_path: Path) -> None:
    import mujoco

    example = _module("grasps_in_mujoco")
    twin = manitwin.Dataset(built[0] / "twins")[0]
    object_file = manitwin.export_twin(twin, "mjcf", tmp_path)["mjcf"]
    beside = twin.grasps().gripper_to_object[0].copy()
    beside[:3, 3] += [0.0, 0.0, 0.2]
    (object_file.parent / "scene.xml").write_text(example.scene(object_file, beside, 0.08))
    rose = example.risen_m(mujoco.MjModel.from_xml_path(str(object_file.parent / "scene.xml")), 0.08)
    assert rose < 0, "it falls"


@pytest.mark.slow
def test_a_layout_is_exported_and_rests_in_mujoco(built: tuple[Path, str]) -> None:
    printed = run("layout_to_mjcf.py", built[0], "twins", "scenes")
    found = re.search(r"3 bodies; in one second none moves by more than ([\d.]+) mm", printed)
    assert found and float(found[1]) < 1.0, printed


@pytest.mark.slow
def test_episodes_are_read_without_the_package(built: tuple[Path, str]) -> None:
    printed = run("plain_episodes.py", built[0], "twins", "episodes")
    assert "'kept'" in printed
    assert re.search(r"traj_0: \d+ steps of 8 numbers; the object goes 0\.\d+ m", printed)
    assert re.search(r"LeRobot: \d+ frames", printed)


def test_the_notebook_of_one_twin_shows_its_card_views_hulls_and_grasps(
    built: tuple[Path, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MANITWIN_TWINS", str(built[0] / "twins"))
    book = executed("explore_a_twin.ipynb", built[0])
    assert pictures(book) == 5
    assert "'held'" in words(book)


@pytest.mark.slow
def test_the_notebook_of_a_data_set_counts_what_is_in_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number, category in enumerate(("brick", "brick", "kettle")):
        write_brick(tmp_path / "dataset", number, category)
    subprocess.run([sys.executable, "-m", "manitwin", "index", tmp_path / "dataset"], check=True)
    monkeypatch.setenv("MANITWIN_DATASET", str(tmp_path / "dataset"))
    book = executed("statistics_of_a_data_set.ipynb", tmp_path)
    assert pictures(book) == 2
    said = words(book)
    assert "3 twins" in said
    assert re.search(r"brick\s.*held\s.*12\b", said), "two bricks with six grasps each"


@pytest.mark.parametrize("notebook", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda p: p.name)
def test_notebooks_are_kept_without_outputs(notebook: Path) -> None:
    book = nbformat.read(notebook, as_version=4)
    nbformat.validate(book)
    assert all(not cell.get("outputs") and not cell.get("execution_count") for cell in book.cells)
    sources = "\n".join(cell.source for cell in book.cells)
    assert not re.findall(r"(?<![\w.:/\])}])/\w[\w.-]*/[\w.]+|~/", sources), "an absolute path is of one machine"


def test_the_page_of_the_examples_names_each_of_them() -> None:
    text = (ROOT / "docs" / "programs.md").read_text()
    there = {path.name for path in EXAMPLES.iterdir() if path.suffix in (".py", ".ipynb")}
    assert there == set(re.findall(r"\]\(\.\./examples/([\w.]+)\)", text))


def executed(notebook: str, folder: Path) -> Any:
    book = nbformat.read(EXAMPLES / notebook, as_version=4)
    NotebookClient(book, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    return book


def outputs(book: Any) -> list[Any]:
    return [output for cell in book.cells if cell.cell_type == "code" for output in cell.outputs]


def pictures(book: Any) -> int:
    return sum("image/png" in output.get("data", {}) for output in outputs(book))


def words(book: Any) -> str:
    return "\n".join(output.get("text", "") or output.get("data", {}).get("text/plain", "") for output in outputs(book))


def _module(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
