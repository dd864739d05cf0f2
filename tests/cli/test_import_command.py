"""``manitwin import`` and ``audit`` of what holds no asset."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from manitwin.cli.main import app
from manitwin.errors import UsageError

VALID = "no asset of a known format; valid are twin folders, RoboTwin"


def test_import_that_imported_nothing_names_formats_and_advises_no_build_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("set").mkdir()
    Path("set/mug.obj").touch()
    done = CliRunner().invoke(app, ["import", "set", "-o", "im4"])
    assert done.exit_code == 3 and done.stdout == "0 imported, 1 not\n" and not Path("im4").exists()
    assert done.stderr.startswith(f"set: holds {VALID}") and "a plain mesh goes to `manitwin build`" in done.stderr


def test_audit_of_a_folder_without_assets_names_formats(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["audit", str(tmp_path)])
    assert isinstance(done.exception, UsageError) and VALID in str(done.exception)
    assert "a plain mesh goes to `manitwin build`" in str(done.exception)
