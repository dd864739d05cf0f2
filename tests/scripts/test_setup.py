"""The set-up script: what it asks of a machine, and that the answer may be no."""

from __future__ import annotations

import importlib
import shutil
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"


@pytest.fixture(scope="module")
def setup() -> ModuleType:
    """The script as a module."""
    sys.path.insert(0, str(SCRIPTS))
    try:
        return importlib.import_module("setup")
    finally:
        sys.path.remove(str(SCRIPTS))
        sys.modules.pop("setup", None)


def test_a_machine_whose_driver_is_missing_cannot_render(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from manitwin.render import device

    monkeypatch.delenv(device.FOUND, raising=False)
    for name in device.LOADER_VARIABLES:
        monkeypatch.setenv(name, str(tmp_path / "nothing.json"))
    assert setup.can_render() is False


def test_this_machine_can_render(setup: ModuleType) -> None:
    assert setup.can_render() is True


def test_a_probe_that_says_nothing_is_a_no(setup: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    silent = tmp_path / "bin" / "python"
    silent.parent.mkdir()
    silent.write_text("#!/bin/sh\nexit 0\n")
    silent.chmod(0o755)
    monkeypatch.setattr(setup, "VENV", tmp_path)
    assert setup.can_render() is False


@pytest.mark.parametrize(("free", "there", "stops"), [(2e9, 0, True), (5e9, 0, False), (2e9, 2.5e9, False)])
def test_set_up_stops_at_once_where_the_packages_cannot_fit(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, free: float, there: float, stops: bool
) -> None:
    class Entry:
        def lstat(self) -> SimpleNamespace:
            return SimpleNamespace(st_blocks=int(there) // 512)

    monkeypatch.setattr(setup, "VENV", SimpleNamespace(rglob=lambda pattern: [Entry()]))
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=int(free)))
    if not stops:
        setup.require_room()
        return
    with pytest.raises(SystemExit, match=r"2\.0 GB free, the packages take 3\.8 GB"):
        setup.require_room()


def test_set_up_stops_where_no_package_has_a_missing_library(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[list[str]] = []

    def package_of_none(libraries: list[str]) -> list[str]:
        asked.append(libraries)
        return []

    monkeypatch.setattr(setup, "LIBRARIES_STAMP", tmp_path / "stamp")
    monkeypatch.setattr(setup, "missing_libraries", lambda folder: ["libQ.so.6"])
    monkeypatch.setattr(setup.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(setup, "packages_by_policy", package_of_none)
    monkeypatch.setattr(setup, "packages_by_contents", package_of_none)
    with pytest.raises(SystemExit, match=r"no package was found for libQ\.so\.6"):
        setup.install_libraries()
    assert asked == [["libQ.so.6"], ["libQ.so.6"]], "by the name that policy gives, then by contents"
    assert not (tmp_path / "stamp").exists()


def test_libraries_are_asked_for_again_only_after_a_change(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[Path] = []

    def nothing_missing(folder: Path) -> list[str]:
        asked.append(folder)
        return []

    monkeypatch.setattr(setup, "LIBRARIES_STAMP", tmp_path / "stamp")
    monkeypatch.setattr(setup, "missing_libraries", nothing_missing)
    setup.install_libraries()
    first = len(asked)
    setup.install_libraries()
    assert first > 0 and len(asked) == first
    (tmp_path / "stamp").write_text("of other packages")
    setup.install_libraries()
    assert len(asked) > first


def test_bytecode_is_written_also_where_python_is_told_not_to(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "src" / "thing").mkdir(parents=True)
    (tmp_path / "src" / "thing" / "module.py").write_text("VALUE = 1\n")
    (tmp_path / "src" / "thing" / "broken.py").write_text("def\n")
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    monkeypatch.setattr(setup, "ROOT", tmp_path)
    setup.compile_sources()
    assert len(list(tmp_path.glob("src/thing/__pycache__/module.*.pyc"))) == 1, "and one that is broken stops nothing"
