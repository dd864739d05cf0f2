"""What is installed from a wheel, away from this repository: every file that the package reads, and a twin built with it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from email.parser import Parser
from importlib.metadata import Distribution, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import manitwin

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "manitwin"


def build_wheel(tree: Path, out: Path) -> Path:
    """Build as the README does, with the build backend that is installed instead of one that is fetched."""
    words = ["pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index", "-w", str(out), str(tree)]
    _run([sys.executable, "-m", *words], cwd=out)
    (wheel,) = out.glob("*.whl")
    return wheel


def _run(words: list[str], cwd: Path, environment: dict[str, str] | None = None) -> str:
    done = subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, f"{words}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_wheel(ROOT, tmp_path_factory.mktemp("wheel"))


def _contents(wheel: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _metadata(wheel: Path) -> dict[str, list[str]]:
    (text,) = (content for name, content in _contents(wheel).items() if name.endswith(".dist-info/METADATA"))
    message = Parser().parsestr(text.decode())
    return {name: message.get_all(name) or [] for name in message}


def test_wheel_is_named_as_the_pages_say(wheel: Path) -> None:
    for page in ("README.md", "docs/platforms.md"):
        said = re.findall(r"[\w.-]+\.whl", (ROOT / page).read_text())
        assert said and set(said) == {wheel.name}, page


def test_wheel_holds_every_file_of_the_package_and_no_others(wheel: Path) -> None:
    there = {f"manitwin/{path.relative_to(PACKAGE).as_posix()}": path for path in PACKAGE.rglob("*") if path.is_file()}
    there = {name: path for name, path in there.items() if "__pycache__" not in name}
    held = {name: content for name, content in _contents(wheel).items() if ".dist-info/" not in name}
    assert held.keys() == there.keys()
    assert all(content == there[name].read_bytes() for name, content in held.items())
    kinds = {Path(name).suffix for name in held}
    assert {".py", ".toml", ".md", ".css", ".frag", ".vert", ".typed"} <= kinds


def test_wheel_registers_the_command_and_the_builtin_backends(wheel: Path) -> None:
    (text,) = (content for name, content in _contents(wheel).items() if name.endswith("entry_points.txt"))
    assert (
        "manitwin = manitwin.cli.entry:main" in text.decode() and "builtin = manitwin.models.builtin" in text.decode()
    )
    assert any(name.endswith("licenses/LICENSE") for name in _contents(wheel))
    assert _metadata(wheel)["Version"] == [manitwin.__version__]


def test_source_archive_makes_the_same_wheel(wheel: Path, tmp_path: Path) -> None:
    _run([sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)], cwd=ROOT)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as content:
        content.extractall(tmp_path, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
    (tree,) = (path for path in tmp_path.iterdir() if path.is_dir())
    for name in ("LICENSE", "README.md", "requirements.lock", "Makefile", "samples/samples.csv", "docs/twin.md"):
        assert (tree / name).read_bytes() == (ROOT / name).read_bytes()
    assert not [path for path in tree.rglob("*") if path.name in (".venv", ".git", "__pycache__")]
    (tmp_path / "out").mkdir()
    assert _contents(build_wheel(tree, tmp_path / "out")) == _contents(wheel)


@pytest.mark.slow
def test_wheel_builds_twins_in_a_fresh_environment_elsewhere(wheel: Path, tmp_path: Path) -> None:
    """Nothing is there but the wheel and what it says that it needs: no extra, no tool of development, no repository."""
    python = fresh_environment(tmp_path / "fresh", wheel)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for sample in (ROOT / "samples").iterdir():
        shutil.copy(sample, elsewhere)
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL"))}
    where = "import manitwin; print(manitwin.__version__, manitwin.__file__)"
    version, file = _run([str(python), "-c", where], elsewhere, environment).split()
    assert version == manitwin.__version__ and Path(file).is_relative_to(tmp_path / "fresh")
    command = [str(python.parent / "manitwin"), "build", "samples.csv", "-o", "twins", "--quick", "--jobs", "1"]
    said = _run(command, elsewhere, environment)
    twins = sorted((elsewhere / "twins").glob("twins/*/*/twin.json"))
    assert len(twins) == 2, said
    for record in twins:
        twin = manitwin.load(record.parent, verify=True)
        assert twin.record.status == "accepted" and len(twin.grasps()) > 0


def fresh_environment(folder: Path, wheel: Path) -> Path:
    """Make a virtual environment with the wheel and, linked from this one, the packages that it needs; returns its Python."""
    venv.create(folder, with_pip=False, symlinks=True)
    python = folder / "bin" / "python"
    words = ["pip", "--python", str(python), "install", "--quiet", "--no-deps", "--no-index", str(wheel)]
    _run([sys.executable, "-m", *words], cwd=folder)
    (site,) = (folder / "lib").glob("python*/site-packages")
    for package in needed(_metadata(wheel)["Requires-Dist"]):
        for top in {path.parts[0] for path in package.files or () if path.parts[0] not in ("..", "__pycache__")}:
            if not (site / top).exists():
                (site / top).symlink_to(Path(str(package.locate_file(top))))
    return python


def needed(requirements: list[str]) -> list[Distribution]:
    """Return the installed packages that requirements want, and those that these want, each once."""
    found: dict[str, Distribution] = {}
    todo = [(line, frozenset({""})) for line in requirements]
    while todo:
        line, extras = todo.pop()
        requirement = Requirement(line)
        if requirement.marker and not any(requirement.marker.evaluate({"extra": extra}) for extra in extras):
            continue
        package = distribution(requirement.name)
        key = f"{package.name}[{','.join(sorted(requirement.extras))}]"
        if key not in found:
            found[key] = package
            todo += [(each, frozenset({"", *requirement.extras})) for each in package.requires or ()]
    return list({package.name: package for package in found.values()}.values())
