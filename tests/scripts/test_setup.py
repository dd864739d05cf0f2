"""The set-up script: what it asks of a machine, and that the answer may be no."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "setup.py"


@pytest.fixture(scope="module")
def setup() -> ModuleType:
    """The script as a module."""
    spec = importlib.util.spec_from_file_location("manitwin_setup", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


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
